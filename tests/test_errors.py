"""Every error of ours comes out of another process with the sentence and the facts that it went in with."""

import importlib
import inspect
import pickle
import pkgutil
import typing
from pathlib import Path

import sonarlog
from sonarlog import ros2
from sonarlog.errors import SonarlogError
from sonarlog.mcap_file import McapReader

SAMPLES = {
    str: "some text",
    int: 7,
    float: 2.5,
    bool: True,
    bytes: b"\x01",
    Path: Path("some/file.mcap"),
    type: ros2.Range,
    object: "something",
    Exception: ValueError("why"),
    OSError: OSError(2, "No such file or directory"),
    McapReader: McapReader(Path(__file__).parents[1] / "recordings" / "bend.mcap"),
}


def all_errors(base: type[SonarlogError] = SonarlogError) -> set[type[SonarlogError]]:
    found = {base}
    for kind in base.__subclasses__():
        found |= all_errors(kind)
    return found


def sample(hint: object) -> object:
    """A value of that type; of a union's members the first that there is a value of."""
    kinds = [typing.get_origin(kind) or kind for kind in (typing.get_args(hint) or (hint,))]
    return next((SAMPLES[kind] for kind in kinds if kind in SAMPLES), None)


def test_every_error_survives_pickling() -> None:
    for module in pkgutil.walk_packages(sonarlog.__path__, "sonarlog."):
        importlib.import_module(module.name)
    kinds = all_errors()
    assert len(kinds) > 50
    for kind in sorted(kinds, key=lambda each: (each.__module__, each.__qualname__)):
        if kind.__init__ is Exception.__init__:
            error = kind("what, where, what to do")
        else:
            asked = inspect.signature(kind).parameters.values()
            hints = typing.get_type_hints(kind.__init__)
            given = [sample(hints[each.name]) for each in asked if each.kind != each.KEYWORD_ONLY]
            named = {each.name: sample(hints[each.name]) for each in asked if each.kind == each.KEYWORD_ONLY}
            error = kind(*given, **named)
        back = pickle.loads(pickle.dumps(error))
        assert (type(back), str(back), vars(back)) == (kind, str(error), vars(error)), kind
