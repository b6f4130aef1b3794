"""The algorithms by name: which blocks, with which configuration. An algorithm is data."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from slam.association import Association, AssociationConfig, Chains
from slam.config import Config, configured
from slam.errors import SlamError
from slam.features import FeatureConfig
from slam.geometry import Pose
from slam.localisation import Localisation, LocalisationConfig, keep_prediction, search
from slam.self_calibration import SelfCalibrationConfig

Localise = Callable[[Pose, Association, Chains, LocalisationConfig], Localisation]


@dataclass(frozen=True)
class Algorithm:
    """A named composition of blocks; `version` grows when the same name gives other maps."""

    name: str
    version: int
    about: str
    localise: Localise
    config: Config

    def configured(self, settings: Mapping[str, object]) -> "Algorithm":
        """With some settings changed, each named `block.key`. Raises SlamError for an unknown name or a wrong type."""
        return replace(self, config=configured(self.config, settings))


ALGORITHMS = {
    algorithm.name: algorithm
    for algorithm in (
        Algorithm(
            "odometry",
            1,
            "no correction: the robot's own dead reckoning (the paper's figures 8 and 11)",
            keep_prediction,
            Config(self_calibration=SelfCalibrationConfig(fit=False)),
        ),
        Algorithm(
            "literal",
            1,
            "the paper to the letter: every RCD of wall kind, strict minimum over the window",
            search,
            Config(
                features=FeatureConfig(only_strong_walls=False),
                association=AssociationConfig(tell_points=False),
                localisation=LocalisationConfig(shift_price=0.0),
            ),
        ),
        Algorithm(
            "paper",
            1,
            "the paper's blocks, but only strong RCDs are walls, points are told from walls, and shifts have a price",
            search,
            # A search in whole degrees and 5 cm cells leaves half of each; from station to station they add up.
            Config(localisation=LocalisationConfig(angle_step_deg=0.5, window=51, cell_m=0.01)),
        ),
    )
}
DEFAULT = "paper"


def algorithm(name: str) -> Algorithm:
    """The algorithm of that name. Raises SlamError listing the known ones."""
    if name not in ALGORITHMS:
        raise SlamError(f"no algorithm {name!r}; there are {', '.join(ALGORITHMS)}")
    return ALGORITHMS[name]
