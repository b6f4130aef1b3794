"""What a side of a diff may be, the cache that keeps what was replayed, and bisection, held against known histories."""

import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cli.main import run as sonarlog
from sonarlog import making
from sonarlog.bisect import NothingToFind, bisect
from sonarlog.cache import NoCache, RunCache
from sonarlog.making import run_of
from sonarlog.revision import HOME, NoSuchCode, code_key, key_of
from sonarlog.robot import BadRobot, load_robot
from sonarlog.runs import read_run
from sonarlog.sides import BadSide, RunFile, Version, parse_side, version

REC = Path("a.mcap")
VERSIONS = {
    "paper": Version(REC, "paper"),
    "paper:association.d1_m=0.1,map.wall=3": Version(
        REC, "paper", (("association.d1_m", 0.1), ("map.wall", 3))
    ),
    "git:HEAD~3": Version(REC, revision="HEAD~3"),
    "git:HEAD@{1}": Version(REC, revision="HEAD@{1}"),
    "git:v0.1:literal": Version(REC, "literal", revision="v0.1"),
    "git:WORKTREE:paper:map.wall=3": Version(REC, "paper", (("map.wall", 3),), "WORKTREE"),
}  # fmt: skip


@pytest.mark.parametrize(("asked", "expected"), VERSIONS.items())
def test_versions_are_read_as_they_are_written(
    asked: str, expected: Version, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    REC.touch()
    assert parse_side(f"{REC}@{asked}") == expected
    assert str(expected) == f"{REC}@{asked}"
    assert parse_side(str(REC)) == RunFile(REC)
    Path("x@paper").touch()
    assert parse_side("x@paper") == RunFile(Path("x@paper"))
    assert parse_side("x@paper@paper") == Version(Path("x@paper"), "paper")


@pytest.mark.parametrize(
    ("text", "words"),
    [("no.mcap", "there is no no.mcap"), ("no.mcap@paper", "there is no recording no.mcap"),
     ("a.mcap@", "which version"), ("a.mcap@git:", "which revision"),
     ("a.mcap@d1=3", "the algorithm comes first"), ("a.mcap@paper:d1", "key=value")],
)  # fmt: skip
def test_what_is_no_side_is_told_in_a_sentence(
    text: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    REC.touch()
    with pytest.raises(BadSide, match=words):
        parse_side(text)


def test_a_version_is_replayed_once(
    short_recording: Path, short_run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache = RunCache(tmp_path / "cache")
    made = run_of(Version(short_recording, "paper"), cache)
    assert made.digest == read_run(short_run).digest
    monkeypatch.setattr(making, "replay", None)
    assert run_of(Version(short_recording, "paper"), cache).digest == made.digest
    made.path.write_bytes(made.path.read_bytes()[:-100])  # damaged on the disk: it is made anew
    with pytest.raises(TypeError):
        run_of(Version(short_recording, "paper"), cache)
    assert cache.kept() == []


def test_the_cache_drops_what_was_used_longest_ago(tmp_path: Path) -> None:
    def keep(cache: RunCache, key: str) -> None:
        with cache.making(key) as path:
            path.write_bytes(bytes(400))

    for key in ("old", "older"):
        keep(RunCache(tmp_path, 1000), key)
    assert RunCache(tmp_path, 1000).get("old")
    cache = RunCache(tmp_path, 1000)
    keep(cache, "new")
    assert {each.path.name for each in cache.kept()} == {"old.run.mcap", "new.run.mcap"}
    assert cache.get("older") is None
    with cache.making("nothing"):
        pass
    assert cache.get("nothing") is None
    assert len(cache.clear()) == 2
    assert cache.kept() == []


def test_where_the_cache_is(tmp_path: Path) -> None:
    assert RunCache.of({"XDG_CACHE_HOME": str(tmp_path)}).folder == tmp_path / "sonarlog"
    cache = RunCache.of({"SONARLOG_CACHE": str(tmp_path / "c"), "XDG_CACHE_HOME": "/x", "SONARLOG_CACHE_MB": "2"})
    assert (cache.folder, cache.limit) == (tmp_path / "c", 2 << 20)
    with pytest.raises(NoCache, match="no number"):
        RunCache.of({"SONARLOG_CACHE_MB": "lots"})
    (tmp_path / "file").touch()
    with pytest.raises(NoCache, match="name another folder in SONARLOG_CACHE"), RunCache(tmp_path / "file").making("a"):
        pass


def test_the_cache_is_shown_and_cleared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SONARLOG_CACHE", str(tmp_path))
    with RunCache(tmp_path).making("abc") as path:
        path.write_bytes(bytes(2_000_000))
    assert sonarlog(["cache"]) == 0
    assert "1 run, 2.0 MB, in" in capsys.readouterr().out
    assert sonarlog(["cache", "--clear", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["bytes"] == 2_000_000
    assert list(tmp_path.iterdir()) == []


@given(st.lists(st.booleans(), max_size=12), st.integers(0, 12), st.data())
@settings(deadline=None)
def test_bisection_finds_the_first_bad_one(runs: list[bool], first: int, data: st.DataObject) -> None:
    first = min(first, len(runs))
    names = [f"r{k}" for k in range(len(runs))]
    tried: list[str] = []

    def judge(name: str) -> bool | None:
        assert name not in tried
        tried.append(name)
        k = int(name[1:])
        return k >= first if runs[k] else None

    runnable = [k for k, fine in enumerate(runs) if fine]
    bad = [k for k in runnable if k >= first]
    if not bad:
        with pytest.raises(NothingToFind):
            bisect("good", names, judge)
        return
    found = bisect("good", names, judge)
    before = max((k for k in runnable if k < first), default=-1)
    assert (found.good, found.bad) == (names[before] if before >= 0 else "good", names[bad[0]])
    assert found.between == tuple(names[before + 1 : bad[0]])
    assert found.tried == len(tried)


needs_git = pytest.mark.skipif(not shutil.which("git"), reason="no git")
PLANTED = """

_extract = extract_features


def extract_features(reliability, config):
    from dataclasses import replace

    return replace(_extract(reliability, config), walls=())
"""


@pytest.fixture(scope="module")
def history(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A checkout: as it is, a remark, code that does not run, features without walls, another remark; and no slam/."""
    folder = tmp_path_factory.mktemp("history")
    for package in ("slam", "sonarlog", "cli"):
        shutil.copytree(HOME / package, folder / package, ignore=shutil.ignore_patterns("__pycache__"))
    features = folder / "slam" / "features.py"
    whole = features.read_text(encoding="utf-8")
    texts = ["", "# A remark.\n", "def broken(\n", PLANTED, f"{PLANTED}# Another remark.\n"]

    def git(*words: str) -> None:
        identity = ("-c", "user.name=test", "-c", "user.email=test@example.org", "-c", "commit.gpgsign=false")
        subprocess.run(["git", *identity, *words], cwd=folder, check=True, capture_output=True)

    git("init", "-q")
    for number, text in enumerate(texts):
        features.write_text(whole + text, encoding="utf-8")
        git("add", "-A")
        git("commit", "-q", "-m", f"version {number}", "--allow-empty")
        git("tag", f"v{number}")
    git("rm", "-r", "-q", "slam")
    git("commit", "-q", "-m", "no slam")
    git("tag", "v5")
    git("checkout", "-q", "v4")
    return folder


@needs_git
def test_the_same_code_has_one_key_wherever_it_lies(history: Path) -> None:
    assert key_of("v0", history) == code_key(HOME)
    assert key_of("v4", history) == key_of("WORKTREE", history) == code_key(history)
    assert len({key_of(f"v{k}", history) for k in range(5)}) == 5
    with pytest.raises(NoSuchCode, match="'v5' has no slam/"):
        key_of("v5", history)
    with pytest.raises(NoSuchCode, match="no code of revision 'nonsense'"):
        key_of("nonsense", history)


@needs_git
def test_the_first_bad_revision_is_found_and_its_diff_shown(
    history: Path, short_recording: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(history)
    recording = str(short_recording)
    assert sonarlog(["bisect", recording, "v0..v4", "--block", "D", "--algorithm", "paper", "--", "-q"]) == 0
    said = capsys.readouterr()
    assert "version 3" in said.out.splitlines()[0]
    assert "which do not run" in said.err
    assert "there feature extraction (block D) differs" in said.out
    assert "walls.gone" not in said.out
    gate = ["--", "-q", "--fail-on", "walls<1"]
    assert sonarlog(["bisect", recording, "v0..v4", "--algorithm", "paper", *gate]) == 0
    assert "version 3" in capsys.readouterr().out.splitlines()[0]
    assert sonarlog(["bisect", recording, "v0..v1", "--algorithm", "paper", *gate]) == 2
    assert "is not bad: there is nothing to search for" in capsys.readouterr().err
    assert sonarlog(["bisect", recording, "v0-v1"]) == 2
    assert sonarlog(["bisect", recording, "v0..v1", "--block", "E", *gate]) == 2
    capsys.readouterr()
    # All of it is in the cache now.
    monkeypatch.setattr(making, "replay_with", None)
    monkeypatch.setattr(making, "replay", None)
    words = ["-q", "--json", "--fail-on", "walls<1"]
    assert sonarlog(["diff", f"{recording}@git:v1:paper", f"{recording}@git:v4:paper", *words]) == 1
    report = json.loads(capsys.readouterr().out)
    assert report["names"] == ["git:v1:paper", "git:v4:paper"]
    assert report["reasons"] == ["walls<1: walls is 0"]


@needs_git
def test_many_recordings_against_a_revision(
    history: Path,
    short_recording: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(history)
    (tmp_path / "text.mcap").write_text("hello")
    files = [str(short_recording), str(tmp_path / "text.mcap")]
    words = ["diff", *files, "--against", "v0", "--algorithm", "paper", "-q"]
    assert sonarlog([*words, "--junit", str(tmp_path / "junit.xml")]) == 1
    said = capsys.readouterr().out
    assert said.startswith("0 changed, 1 the same, 1 failed\n")
    assert 'tests="2" failures="0" errors="1"' in (tmp_path / "junit.xml").read_text()
    assert sonarlog(["diff", files[0], "--against", "v5", "-q"]) == 2
    assert "'v5' has no slam/" in capsys.readouterr().err


def test_an_empty_version_is_the_default() -> None:
    assert version(REC, "") == Version(REC)
    assert (version(REC, "").label, str(version(REC, ""))) == ("now", "a.mcap")


def test_a_robot_that_is_given_is_part_of_what_the_run_hangs_on(
    short_recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cache = RunCache.of({"SONARLOG_CACHE": str(tmp_path / "cache")})
    own = Version(short_recording, "odometry")
    made = run_of(replace(own, robot="amigo-sh"), cache)
    assert made.identity.given_robot == load_robot("amigo-sh")
    assert run_of(own, cache).identity.given_robot is None
    with pytest.raises(BadRobot, match="'nobody' is not built in"):
        run_of(replace(own, robot="nobody"), cache)
    assert sonarlog(["diff", *[str(short_recording)] * 2, "--robot", "amigo-sh"]) == 2
    assert "--robot goes with sides that are replayed" in capsys.readouterr().err
