"""The door to MCAP: what is written is there, nothing is overwritten, damage is told and survived."""

import random
import resource
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sonarlog import mcap_file
from sonarlog.mcap_file import CannotRead, CannotWrite, McapReader, McapWriter, NotMcap, OutputExists, partial_path


def write(path: Path, *, chunks: int = 5, force: bool = False) -> None:
    with McapWriter(path, force=force) as writer:
        text = writer.channel("/text", "std_msgs/msg/String", "string data\n")
        steps = writer.channel("/steps", "step", '{"type": "object"}', encoding="json")
        writer.metadata("made", {"by": "test"})
        for chunk in range(chunks):
            for i in range(20):
                writer.write(text if i % 2 else steps, 1000 * chunk + 10 * (i ^ 1), b"%d/%d" % (chunk, i))
            writer.flush(fsync=chunk == 0)
        writer.attachment("a.json", "application/json", b"{}")


@pytest.fixture
def sound(tmp_path: Path) -> Path:
    path = tmp_path / "sound.mcap"
    write(path)
    return path


def test_what_is_written_is_read(sound: Path) -> None:
    file = McapReader(sound)
    assert file.damage == ()
    assert file.metadata == {"made": {"by": "test"}}
    assert file.attachments["a.json"].data == b"{}"
    messages = file.messages()
    assert len(messages) == 100
    times = [message.log_time_ns for message in messages]
    assert times == sorted(times)
    assert messages[0] == ("/text", "std_msgs/msg/String", "cdr", 0, b"0/1")
    assert {message.topic for message in file.stream({"/steps"})} == {"/steps"}


def test_same_calls_give_the_same_bytes(sound: Path, tmp_path: Path) -> None:
    write(tmp_path / "again.mcap")
    assert (tmp_path / "again.mcap").read_bytes() == sound.read_bytes()


def test_nothing_is_overwritten(sound: Path) -> None:
    before = sound.read_bytes()
    with pytest.raises(OutputExists, match="--force"):
        write(sound)
    assert sound.read_bytes() == before
    write(sound, chunks=1, force=True)
    assert len(McapReader(sound).messages()) == 20


def test_a_file_that_appears_meanwhile_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    writer = McapWriter(path)
    path.write_text("somebody else's")
    with pytest.raises(OutputExists, match=r"a\.mcap\.part"):
        writer.finish()
    assert path.read_text() == "somebody else's"
    assert McapReader(partial_path(path)).damage == ()


def test_an_unfinished_file_is_recognisable_and_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    writer = McapWriter(path)
    assert not path.exists()
    with pytest.raises(OutputExists, match="never finished"):
        McapWriter(path)
    writer.abandon()
    assert list(tmp_path.iterdir()) == []


def test_an_exception_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError), McapWriter(tmp_path / "a.mcap"):
        _ = 1 // 0
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_refuses_is_told_and_keeps_what_was_flushed(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    writer = McapWriter(path)
    channel = writer.channel("/text", "std_msgs/msg/String", "string data\n")
    writer.write(channel, 1, b"kept")
    writer.flush()
    writer.write(channel, 2, random.Random(1).randbytes(10_000))
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limits[1]))
    try:
        with pytest.raises(CannotWrite, match="File too large"):
            writer.flush()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    writer.finish()  # a failed writer has nothing left to finish
    assert not path.exists()
    file = McapReader(partial_path(path))
    assert [message.data for message in file.messages()] == [b"kept"]
    assert len(file.damage) == 1


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda path: None, CannotRead, "No such file"),
        (lambda path: path.mkdir(), CannotRead, "directory"),
        (lambda path: path.write_bytes(b""), NotMcap, "empty"),
        (lambda path: path.write_bytes(b"\x89MCAP"), NotMcap, "does not begin"),
        (lambda path: path.write_text("a,b\n1,2\n"), NotMcap, "does not begin"),
    ],
)
def test_other_files_are_refused_in_a_sentence(
    tmp_path: Path, make: Callable[[Path], object], error: type[Exception], words: str
) -> None:
    path = tmp_path / "x.mcap"
    make(path)
    with pytest.raises(error, match=words):
        McapReader(path)


def test_every_truncation_gives_the_whole_chunks_and_says_so(sound: Path, tmp_path: Path) -> None:
    data = sound.read_bytes()
    expected = [message.data for message in McapReader(sound).stream()]
    cut = tmp_path / "cut.mcap"
    seen = set()
    for size in range(8, len(data), 7):
        cut.write_bytes(data[:size])
        file = McapReader(cut)
        assert len(file.damage) == 1
        assert "cut off" in file.damage[0] or "never finished" in file.damage[0]
        found = [message.data for message in file.stream()]
        assert found == expected[: len(found)]
        seen.add(len(found))
    assert seen == {0, 20, 40, 60, 80, 100}


def test_flipped_bits_never_give_wrong_data_without_a_word(sound: Path, tmp_path: Path) -> None:
    data = sound.read_bytes()
    file = McapReader(sound)
    expected = (file.metadata, file.attachments, file.messages())
    flipped = tmp_path / "flipped.mcap"
    chance = random.Random(1)
    for _ in range(300):
        at = chance.randrange(64, 8 * len(data))
        bits = bytearray(data)
        bits[at // 8] ^= 1 << at % 8
        flipped.write_bytes(bits)
        file = McapReader(flipped)
        assert file.damage or (file.metadata, file.attachments, file.messages()) == expected, f"bit {at}"


def test_no_flipped_bit_in_a_records_head_goes_unnoticed_where_no_checksum_covers_it(tmp_path: Path) -> None:
    writer = McapWriter(tmp_path / "a.mcap", message_index=True)
    text = writer.channel("/text", "std_msgs/msg/String", "string data\n")
    for chunk in range(2):
        for i in range(3):
            writer.write(text, 1000 * chunk + i, b"%d/%d" % (chunk, i))
        writer.flush()
    writer.metadata("made", {"by": "test"})
    writer.attachment("a.json", "application/json", b"{}")
    writer.flush()
    data = partial_path(writer.path).read_bytes()
    writer.abandon()
    path = tmp_path / "cut.mcap"
    path.write_bytes(data)
    whole = McapReader(path)
    at, kinds = len(mcap_file.MAGIC), b""
    while at < len(data):
        kinds += data[at : at + 1]
        for bit in range(72):
            flipped = bytearray(data)
            flipped[at + bit // 8] ^= 1 << bit % 8
            path.write_bytes(flipped)
            file = McapReader(path)
            told = [sentence for sentence in file.damage if "never finished" not in sentence]
            if bit < 8 and data[at] == 6:  # a chunk without its mark is still known for one
                assert "has lost its mark" in told[0]
                told = []
            found = (file.metadata, file.attachments, file.messages())
            assert told or found == (whole.metadata, whole.attachments, whole.messages()), (at, bit)
        at += 9 + int.from_bytes(data[at + 1 : at + 9], "little")
    assert kinds == b"\1\6\7\6\7\x0c\x09"


@settings(max_examples=50)
@given(st.binary(max_size=200))
def test_rubbish_behind_the_magic_is_damage(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "rubbish.mcap"
    path.write_bytes(mcap_file.MAGIC + data)
    file = McapReader(path)
    assert file.damage
    assert file.messages() == []
