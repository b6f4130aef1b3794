"""Every message type against rosbags, an independent implementation."""

import typing
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from sonarlog import cdr, ros2, ros2_maps, ros2_markers

TYPES = [
    value for module in (ros2, ros2_maps, ros2_markers) for value in vars(module).values() if value in list(cdr._NAMES)
]
STANDARD = get_typestore(Stores.ROS2_JAZZY)
LEAVES: dict[str, st.SearchStrategy[Any]] = {
    "bool": st.booleans(),
    "string": st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"])),
    "float32": st.floats(width=32, allow_nan=False),
    "float64": st.floats(allow_nan=False),
}
for bits in (8, 16, 32):
    LEAVES[f"uint{bits}"] = st.integers(0, 2**bits - 1)
    LEAVES[f"int{bits}"] = st.integers(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)


def values(hint: Any) -> st.SearchStrategy[Any]:
    if hint in TYPES:
        hints = typing.get_type_hints(hint, include_extras=True)
        return st.builds(hint, *(values(part) for part in hints.values()))
    if typing.get_origin(hint) is tuple:
        return st.lists(values(typing.get_args(hint)[0]), max_size=3).map(tuple)
    ros: str = hint.__metadata__[0]
    if ros in ("uint8[]", "int8[]"):
        return st.binary(max_size=9)
    if ros.endswith("]"):
        item, length = ros.removesuffix("]").split("[")
        return st.lists(LEAVES[item], min_size=int(length or 0), max_size=int(length or 3)).map(tuple)
    return LEAVES[ros]


@pytest.mark.parametrize("cls", TYPES)
def test_rosbags_reads_what_we_write_and_writes_the_same_bytes(cls: type[Any]) -> None:
    name = cdr.type_name(cls)
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(cdr.definition(cls), name))

    @given(values(cls))
    def check(value: object) -> None:
        data = cdr.encode(value)
        assert cdr.decode(cls, data) == value
        assert bytes(store.serialize_cdr(store.deserialize_cdr(data, name), name)) == data

    check()


@pytest.mark.parametrize("cls", [cls for cls in TYPES if cls not in (ros2.Wire, ros2_maps.OccupancyGridUpdate)])
def test_definitions_are_the_public_ones(cls: type[Any]) -> None:
    name = cdr.type_name(cls)
    ours = get_types_from_msg(cdr.definition(cls), name)
    for inner, (_, members) in ours.items():
        assert members == STANDARD.fielddefs[inner][1], inner


@given(st.binary(max_size=80))
def test_rubbish_is_refused_by_name(data: bytes) -> None:
    with pytest.raises(cdr.BadMessage, match="nav_msgs/msg/Odometry"):
        cdr.decode(ros2.Odometry, b"\0\1\0\0" + data)


def test_a_range_of_an_older_ros_has_no_variance() -> None:
    reading = ros2.Range(ros2.Header(ros2.Time(1, 2), "sonar_0"), ros2.ULTRASOUND, 0.5, 0.0, 5.0, 1.5)
    data = cdr.encode(reading)[:-4]
    assert cdr.decode(ros2.Range, data, optional=1) == reading
    with pytest.raises(cdr.BadMessage):
        cdr.decode(ros2.Range, data)


def test_big_endian_is_refused() -> None:
    with pytest.raises(cdr.BadMessage, match="little-endian"):
        cdr.decode(ros2.StringMessage, b"\0\0\0\0\0\0\0\1\0")


def test_times_are_exact() -> None:
    assert ros2.Time.of(1_700_000_000_123_456_789).ns == 1_700_000_000_123_456_789
