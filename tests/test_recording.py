"""Recordings: what goes in comes out, by the wire and by the topics; what cannot be read is refused in a sentence."""

import json
from collections import Counter
from dataclasses import replace
from math import inf, nan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from sonarlog import ros2
from sonarlog.cdr import decode, definition, encode, type_name
from sonarlog.decode import WireDecoder, decode_wire
from sonarlog.log import Event, Log, Surfaces
from sonarlog.mcap_file import McapReader, McapWriter, partial_path
from sonarlog.protocol.framing import frame
from sonarlog.protocol.packets import SimStat, Sip
from sonarlog.recording import NotARecording, RecordingWriter, open_recording, read_log, recording_digest
from sonarlog.recording.reader import robot_of, started_wall_ns
from sonarlog.recording.topics import MissingTopics, log_from_topics
from sonarlog.robot import load_robot

ROBOT = load_robot("amigo-sh")
STARTED_NS = 1_790_000_000_123_456_789
SURFACES = Surfaces("test", np.array([[0.0, 1.0, 2.0, 1.0]]), np.array([[1.0, 2.0, 0.1]]))


def wire(sips: int = 40) -> list[tuple[int, str, bytes]]:
    """A robot that turns over its own wrap while it drives, one SIP in each chunk of bytes, now and then a PULSE."""
    chunks = []
    for k in range(sips):
        t_ns = 2_000_000_000 + 100_000_000 * k
        fired = (((2 * k) % 8, 500 + 100 * k), ((2 * k + 1) % 8, 5000))
        sip = Sip(x=(26 * k) & 0x7FFF, y=-13 * k & 0x7FFF, heading=(100 * k + 2048) % 4096 - 2048, sonar=fired)
        truth = SimStat(26 * k, -13 * k, 0, 0, exact=(26_100 * k, -13_100 * k, 25_000 * k))
        chunks.append((t_ns, "rx", frame(sip.encode()) + frame(truth.encode())))
        if k % 5 == 0:
            chunks.append((t_ns + 1_000_000, "tx", frame(b"\0")))
    return chunks


def record(path: Path, *, lean: bool = False, sips: int = 40) -> Path:
    decoder = WireDecoder(ROBOT)
    with RecordingWriter(
        path, started_wall_ns=STARTED_NS, command_line="test", config={"route": "scan"}, lean=lean
    ) as recording:
        recording.event(1_000_000_000, "info", "connected")
        recording.identity({"NAME": "test"}, ROBOT)
        recording.surfaces(SURFACES)
        for t_ns, direction, data in wire(sips):
            recording.wire(t_ns, direction, data)
            for sample in decoder.feed(t_ns, data) if direction == "rx" else []:
                if sample.pose is not None:
                    recording.odometry(t_ns, *sample.pose, velocity_mm_s=260.0)
                    for reading in sample.readings:
                        recording.reading(reading.t_ns, reading.sonar, reading.range_mm)
                    recording.points(t_ns, sample.readings)
                    recording.battery(t_ns, 12.1)
            recording.truth(t_ns, 1.0, 2.0, 0.5)
            if t_ns % 1_000_000_000 == 0:
                recording.flush(fsync=True)
    return path


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("recording") / "test.mcap")


def assert_same(ours: Log, theirs: Log) -> None:
    assert ours.robot == theirs.robot
    for mine, other in ((ours.odometry, theirs.odometry), (ours.readings, theirs.readings)):
        for name, column in vars(mine).items():
            np.testing.assert_array_equal(column, vars(other)[name], name)


def test_the_wire_comes_back(recording: Path) -> None:
    log = read_log(recording)
    expected = decode_wire(wire(), ROBOT)
    assert_same(log, expected)
    assert log.truth is not None
    assert expected.truth is not None
    np.testing.assert_array_equal(log.truth.pose, expected.truth.pose)
    assert log.surfaces is not None
    np.testing.assert_array_equal(log.surfaces.segments, SURFACES.segments)
    assert log.events == (Event(1_000_000_000, "info", "connected"),)
    assert "damage" not in log.counts


def test_topics_hold_the_same_integers_as_the_wire(recording: Path) -> None:
    file = open_recording(recording)
    by_wire = read_log(recording)
    by_topics = log_from_topics(file, robot_of(file), started_wall_ns(file))
    first = by_wire.odometry.t_ns[0]  # readings fired before it have no odometry on the topics
    late = by_wire.readings.t_ns >= first
    kept = replace(by_wire.readings, **{name: column[late] for name, column in vars(by_wire.readings).items()})
    assert_same(by_topics, replace(by_wire, readings=kept))


def test_a_lean_recording_replays_the_same(recording: Path, tmp_path: Path) -> None:
    lean = record(tmp_path / "lean.mcap", lean=True)
    assert_same(read_log(lean), read_log(recording))
    assert recording_digest(lean) == recording_digest(recording)
    assert Counter(m.topic for m in McapReader(lean).stream())["/odom"] == 4
    assert lean.stat().st_size < recording.stat().st_size * 0.6


def test_the_digest_is_the_contents(recording: Path, tmp_path: Path) -> None:
    assert recording_digest(record(tmp_path / "same.mcap")) == recording_digest(recording)
    assert (tmp_path / "same.mcap").read_bytes() == recording.read_bytes()
    assert recording_digest(record(tmp_path / "shorter.mcap", sips=39)) != recording_digest(recording)


def test_log_time_is_the_stamp_and_the_frames_are_one_tree(recording: Path) -> None:
    kinds: dict[str, Any] = {
        type_name(kind): kind
        for kind in (ros2.Odometry, ros2.Range, ros2.PointCloud2, ros2.BatteryState, ros2.PoseStamped)
    }
    parents = {}
    topics = Counter[str]()
    for message in McapReader(recording).messages():
        topics[message.topic] += 1
        if message.schema in kinds:
            assert decode(kinds[message.schema], message.data).header.stamp.ns == message.log_time_ns
        elif message.topic in ("/tf", "/tf_static"):
            for edge in decode(ros2.TFMessage, message.data).transforms:
                assert edge.header.stamp.ns == message.log_time_ns
                parents[edge.child_frame_id] = edge.header.frame_id
    sonars = {f"sonar_{i}": "base_link" for i in range(8)}
    assert parents == {"odom": "map", "base_link": "odom", **sonars}
    assert topics["/odom"] == 40
    assert topics["/sonar/3"] == 10
    assert topics["/battery"] == 1  # it did not change
    clouds = [decode(ros2.PointCloud2, m.data) for m in McapReader(recording).messages({"/sonar/points"})]
    assert len(clouds) == 5  # one a second, and the rest at the end
    assert sum(cloud.width for cloud in clouds) == 40  # every other reading has no echo


def test_no_echo_is_above_the_maximum_range(recording: Path) -> None:
    readings = [decode(ros2.Range, m.data) for m in McapReader(recording).messages({"/sonar/1"})]
    assert all(reading.range > reading.max_range for reading in readings)


def test_rosbags_reads_every_message(recording: Path) -> None:
    with AnyReader([recording]) as bag:
        topics = Counter(connection.topic for connection, _, data in bag.messages())
        wire_bytes = [
            decode(ros2.Wire, bytes(data)).data for connection, _, data in bag.messages() if connection.topic == "/wire"
        ]
    assert topics == Counter(message.topic for message in McapReader(recording).stream())
    assert wire_bytes == [data for _, _, data in wire()]


def test_an_exception_does_not_cost_the_recording(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"

    def interrupted() -> None:
        with RecordingWriter(path, started_wall_ns=0, command_line="", config={}) as recording:
            recording.identity({}, ROBOT)
            recording.wire(1, "rx", frame(Sip(sonar=((0, 1000),)).encode()))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert len(read_log(path).readings.t_ns) == 1


def test_a_cut_recording_gives_what_is_whole_and_says_so(recording: Path, tmp_path: Path) -> None:
    cut = partial_path(tmp_path / "cut.mcap")
    data = recording.read_bytes()
    cut.write_bytes(data[: len(data) // 2])
    log = read_log(cut)
    whole = read_log(recording)
    count = len(log.odometry.t_ns)
    assert 0 < count < len(whole.odometry.t_ns)
    np.testing.assert_array_equal(log.odometry.x_um, whole.odometry.x_um[:count])
    assert log.counts["damage"] == 1
    assert log.events[-1].level == "warn"
    assert "cut off" in log.events[-1].text


def with_metadata(path: Path, name: str, data: dict[str, str], topic: str = "/chatter") -> Path:
    with McapWriter(path) as writer:
        writer.metadata(name, data)
        channel = writer.channel(topic, "std_msgs/msg/String", definition(ros2.StringMessage))
        writer.write(channel, 0, b"\0\1\0\0\1\0\0\0\0")
    return path


@pytest.mark.parametrize(
    ("name", "data", "topic", "error", "words"),
    [
        ("run", {}, "/step", NotARecording, "is a run, not a recording"),
        ("recording", {"schema_version": "99"}, "/wire", NotARecording, "version 99; this sonarlog reads up to 2"),
        ("other", {}, "/chatter", MissingTopics, "holds no sonar readings"),
        ("recording", {"schema_version": "1"}, "/wire", NotARecording, "are no sonarlog_msgs/msg/Wire"),
        ("robot", {"parameters": json.dumps(ROBOT.as_dict())}, "/wire", NotARecording, "are no sonarlog_msgs/msg/Wire"),
    ],
)
def test_other_mcap_files_are_refused(
    tmp_path: Path, name: str, data: dict[str, str], topic: str, error: type[Exception], words: str
) -> None:
    path = with_metadata(tmp_path / "other.mcap", name, data, topic)
    with pytest.raises(error, match=words) as caught:
        read_log(path)
    assert str(path) in str(caught.value)


def foreign_bag(folder: Path, *, static: bool = True) -> Path:
    """A bag as another ROS 2 robot would make it, written by rosbags: all sonars on one topic, mounted on a bar."""
    humble = get_typestore(Stores.ROS2_HUMBLE)
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        topics = {"/tf_static": ros2.TFMessage, "/wheels": ros2.Odometry, "/sonars": ros2.Range}
        channels = {
            topic: bag.add_connection(topic, type_name(kind), typestore=humble) for topic, kind in topics.items()
        }

        def send(topic: str, t_ns: int, message: object) -> None:
            data = encode(message)
            if isinstance(message, ros2.Range):
                data = data[:-4]  # Humble's has no variance
            bag.write(channels[topic], t_ns + 5_000_000, data)  # received 5 ms later

        if static:
            quarter = ros2.Quaternion(z=0.5**0.5, w=0.5**0.5)
            edges = (
                edge("robot", "bar", ros2.Transform(ros2.Vector3(0.1, 0.0, 0.3), quarter)),
                edge("bar", "left_10", ros2.Transform(ros2.Vector3(0.2, 0.0))),
                edge("bar", "left_2", ros2.Transform(ros2.Vector3(0.0, 0.05))),
            )
            send("/tf_static", 0, ros2.TFMessage(edges))
        for k, distance in enumerate((1.5, inf, 4.0, nan, 0.01)):
            t_ns = 10**18 + 10**8 * k
            backwards = ros2.Pose(ros2.Point(0.1 * k), ros2.Quaternion(z=1.0, w=0.0))
            place = ros2.Odometry(header(t_ns, "odom"), "robot", ros2.PoseWithCovariance(backwards))
            send("/wheels", t_ns, place)
            for frame_id, metres in (("left_2", 1.25), ("left_10", distance)):
                fired = header(t_ns - 25_000_000, frame_id)
                send("/sonars", fired.stamp.ns, ros2.Range(fired, ros2.ULTRASOUND, 0.5, 0.02, 4.0, metres))
    return next(folder.glob("*.mcap"))


def header(t_ns: int, frame_id: str) -> ros2.Header:
    return ros2.Header(ros2.Time.of(t_ns), frame_id)


def edge(parent: str, child: str, transform: ros2.Transform) -> ros2.TransformStamped:
    return ros2.TransformStamped(header(0, parent), child, transform)


def test_any_ros_2_bag_with_range_odometry_and_static_tf(tmp_path: Path) -> None:
    log = read_log(foreign_bag(tmp_path / "bag"))
    first, second = log.robot.sonars  # left_2 before left_10
    assert (first.x_mm, first.y_mm, first.heading_deg) == (50.0, 0.0, 90.0)
    assert (second.x_mm, second.y_mm, second.heading_deg) == (100.0, 200.0, 90.0)
    assert log.robot.max_range_mm == 4000
    assert log.robot.half_beam_deg == pytest.approx(14.324, abs=1e-3)
    assert log.readings.range_mm[log.readings.sonar == 1].tolist() == [4000, 4000]
    assert log.readings.range_mm[log.readings.sonar == 0].tolist() == [1250] * 4
    assert log.readings.x_um[log.readings.sonar == 0].tolist() == [75_000, 175_000, 275_000, 375_000]
    assert log.counts == {"readings": 6, "readings_without_odometry": 2, "unusable_readings": 2}
    assert (log.odometry.heading == 1 << 19).all()


def test_a_bag_without_mountings_says_so(tmp_path: Path) -> None:
    with pytest.raises(MissingTopics, match="no static transform from robot to left_2"):
        read_log(foreign_bag(tmp_path / "bag", static=False))


def test_the_robot_goes_with_the_recording(recording: Path) -> None:
    metadata = McapReader(recording).metadata
    assert metadata["recording"]["schema_version"] == "2"
    assert json.loads(metadata["recording"]["config"]) == {"route": "scan"}
    assert metadata["robot"]["NAME"] == "test"
    assert robot_of(open_recording(recording)) == ROBOT
