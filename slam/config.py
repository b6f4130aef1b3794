"""The configuration: one frozen slice a block, settings by name, and the plain form kept with every result."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Any

from slam.association import AssociationConfig
from slam.errors import SlamError
from slam.features import FeatureConfig
from slam.frontier_config import FrontierConfig
from slam.graph.config import GraphConfig
from slam.grid import LIMIT
from slam.landmarks import LandmarkConfig
from slam.localisation import LocalisationConfig
from slam.recognition import RecognitionConfig
from slam.reliability import ReliabilityConfig
from slam.rendering import MapConfig
from slam.self_calibration import SelfCalibrationConfig
from slam.weighing import WeighingConfig

KINDS: dict[type, str] = {int: "a whole number", float: "a number", bool: "true or false"}

RANGES: Mapping[str, tuple[float, float]] = {
    "self_calibration.bearing_sigma_deg": (0.01, 90.0),
    "self_calibration.scale_sigma": (1e-6, 1.0),
    "self_calibration.mounting_sigma_deg": (0.001, 90.0),
    "reliability.arcs.min_readings": (2, LIMIT),
    "reliability.arcs.min_sonars": (1, LIMIT),
    "reliability.bearing_sigma_deg": (0.001, 90.0),
    "reliability.driving.min_readings": (3, LIMIT),
    "reliability.driving.min_baseline_m": (0.01, 100.0),
    "features.corner_min_angle_deg": (1.0, 179.0),
    "features.corner_max_angle_deg": (1.0, 179.0),
    "localisation.angle_step_deg": (0.01, 45.0),
    "localisation.window": (1, 501),
    "localisation.cell_m": (0.001, 1.0),
    "landmarks.along_m": (1e-4, 1.0),
    "landmarks.heading_deg": (0.001, 45.0),
    "landmarks.post_m": (1e-4, 10.0),
    "weighing.bearing_sigma_deg": (0.001, 45.0),
    "weighing.distance_sigma_m": (1e-4, 1.0),
    "weighing.turn_sigma_deg": (0.001, 45.0),
    "weighing.shift_sigma_m": (1e-4, 1.0),
    "weighing.drift_m2": (0.01, 1e6),
    "graph.window": (1, LIMIT),
    "graph.iterations": (1, LIMIT),
    "graph.kernel": (0.1, 100.0),
    "graph.distance_sigma_m": (1e-4, 1.0),
    "graph.step_sigma_m": (1e-4, 1.0),
    "graph.slip_turn_deg": (0.001, 45.0),
    "graph.slip_metre_deg": (0.001, 45.0),
    "graph.heading_sigma_deg": (0.001, 45.0),
    "graph.rotation_sigma": (1e-6, 1.0),
    "graph.scale_sigma": (1e-6, 1.0),
    "graph.drift_sigma_deg": (1e-4, 45.0),
    "graph.ring_sigma_deg": (1e-4, 45.0),
    "graph.match_distance_m": (1e-4, 1.0),
    "map.cell_m": (0.01, 1.0),
    "map.free_from": (-LIMIT, -1),
    "map.occupied_from": (1, LIMIT),
    "frontier.min_cells": (1, LIMIT),
    "frontier.chink_cells": (0, 20),
    "frontier.piece_m": (0.1, 10.0),
    "frontier.apart_m": (0.2, 10.0),
    "frontier.picky_m2": (0.1, 360.0),
    "frontier.settle_m": (0.01, 100.0),
    "frontier.vain_share": (0.0, 1.0),
    "frontier.stay": (1.0, 10.0),
    "frontier.leg_m": (0.1, 10.0),
    "frontier.known_leg_m": (0.1, 10.0),
    "frontier.block_m": (0.0, 1.0),
}
"""From where to where a setting makes sense; those not named are whole numbers from 0 to LIMIT, or go from 0 to 360."""


@dataclass(frozen=True)
class Config:
    """Each block of Fig. 5 gets its own slice and sees no other."""

    self_calibration: SelfCalibrationConfig = field(default_factory=SelfCalibrationConfig)
    reliability: ReliabilityConfig = field(default_factory=ReliabilityConfig)
    features: FeatureConfig = field(default_factory=FeatureConfig)
    association: AssociationConfig = field(default_factory=AssociationConfig)
    landmarks: LandmarkConfig = field(default_factory=LandmarkConfig)
    recognition: RecognitionConfig = field(default_factory=RecognitionConfig)
    localisation: LocalisationConfig = field(default_factory=LocalisationConfig)
    weighing: WeighingConfig = field(default_factory=WeighingConfig)
    graph: GraphConfig = field(default_factory=GraphConfig)
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
        value = float(value)
    if type(value) is not type(default):
        raise SlamError(f"setting {name} takes {KINDS[type(default)]}, not {value!r}")
    if isinstance(value, int | float) and not isinstance(value, bool):
        low, high = RANGES.get(name, (0, LIMIT) if isinstance(value, int) else (0.0, 360.0))
        if not low <= value <= high:
            raise SlamError(f"setting {name} goes from {low:g} to {high:g}; it cannot be {value:g}")
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
