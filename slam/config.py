"""The configuration: one frozen slice a block, settings by name, and the plain form kept with every result."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Any

from slam.association import AssociationConfig
from slam.errors import SlamError
from slam.features import FeatureConfig
from slam.frontier import FrontierConfig
from slam.localisation import LocalisationConfig
from slam.map_extension import MapConfig
from slam.reliability import ReliabilityConfig
from slam.self_calibration import SelfCalibrationConfig

KINDS: dict[type, str] = {int: "a whole number", float: "a number", bool: "true or false"}


@dataclass(frozen=True)
class Config:
    """Each block of Fig. 5 gets its own slice and sees no other."""

    self_calibration: SelfCalibrationConfig = field(default_factory=SelfCalibrationConfig)
    reliability: ReliabilityConfig = field(default_factory=ReliabilityConfig)
    features: FeatureConfig = field(default_factory=FeatureConfig)
    association: AssociationConfig = field(default_factory=AssociationConfig)
    localisation: LocalisationConfig = field(default_factory=LocalisationConfig)
    map: MapConfig = field(default_factory=MapConfig)
    frontier: FrontierConfig = field(default_factory=FrontierConfig)


def settings(config: Any, prefix: str = "") -> dict[str, Any]:
    """Every setting by its full name, such as `association.d1_m`."""
    result: dict[str, Any] = {}
    for entry in fields(config):
        value = getattr(config, entry.name)
        if is_dataclass(value):
            result |= settings(value, f"{prefix}{entry.name}.")
        else:
            result[prefix + entry.name] = value
    return result


def configured(config: Config, changes: Mapping[str, object]) -> Config:
    """The configuration with settings changed by full name. Raises SlamError naming what is unknown or wrong."""
    known = settings(config)
    for name, value in changes.items():
        if name not in known:
            raise SlamError(f"no setting {name!r}{_hint(name, known)}")
        config = _set(config, name.split("."), _checked(name, value, known[name]))
    return config


def _checked(name: str, value: object, default: object) -> object:
    if isinstance(default, float) and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if type(value) is not type(default):
        raise SlamError(f"setting {name} takes {KINDS[type(default)]}, not {value!r}")
    return value


def _set(config: Any, path: list[str], value: object) -> Any:
    inner = value if len(path) == 1 else _set(getattr(config, path[0]), path[1:], value)
    return replace(config, **{path[0]: inner})


def _hint(name: str, known: Mapping[str, object]) -> str:
    block = name.split(".", maxsplit=1)[0]
    near = [other for other in known if other.startswith(f"{block}.")]
    blocks = list(dict.fromkeys(other.split(".")[0] for other in known))
    return (
        f"; {block} has {', '.join(n.removeprefix(block + '.') for n in near)}"
        if near
        else f"; blocks are {', '.join(blocks)}"
    )
