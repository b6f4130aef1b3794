"""The algorithms by name: which blocks, with which configuration. An algorithm is data."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

from slam import chaining
from slam.association import AssociationConfig
from slam.config import Config, configured
from slam.driving import DrivingConfig
from slam.errors import SlamError
from slam.features import FeatureConfig
from slam.graph import smoothing
from slam.graph.matching import match
from slam.localisation import LocalisationConfig, keep_prediction, search
from slam.reliability import ReliabilityConfig
from slam.self_calibration import SelfCalibrationConfig
from slam.trust import Associate, Corrector, Localise, Trusting


@dataclass(frozen=True)
class Algorithm:
    """A named composition of blocks; `version` grows when the same name gives other maps."""

    name: str
    version: int
    about: str
    associate: Associate
    localise: Localise
    config: Config

    def configured(self, settings: Mapping[str, object]) -> "Algorithm":
        """With some settings changed, each named `block.key`. Raises SlamError for an unknown name or a wrong type."""
        return replace(self, config=configured(self.config, settings))


WEIGHING = Trusting(
    Corrector(chaining.recognise_chains, chaining.localise_by_weight, chaining.account_of, chaining.laid_alike)
)
SOLVING = Trusting(Corrector(match, smoothing.smooth, smoothing.solved_account, smoothing.drawn_alike))
FINE = LocalisationConfig(angle_step_deg=0.5, window=51, cell_m=0.01, refuted=27.0)

ALGORITHMS = {
    algorithm.name: algorithm
    for algorithm in (
        Algorithm(
            "odometry",
            5,
            "no correction: the robot's own dead reckoning (the paper's figures 8 and 11)",
            chaining.associate_chains,
            partial(chaining.localise_by, keep_prediction),
            Config(self_calibration=SelfCalibrationConfig(fit=False)),
        ),
        Algorithm(
            "literal",
            5,
            "the paper to the letter: every RCD of wall kind, strict minimum over the window",
            chaining.associate_chains,
            partial(chaining.localise_by, search),
            Config(
                features=FeatureConfig(only_strong_walls=False),
                association=AssociationConfig(tell_points=False),
                localisation=LocalisationConfig(shift_price=0.0),
            ),
        ),
        Algorithm(
            "paper",
            7,
            "the paper's blocks, but only strong RCDs are walls, points are told from walls, corrections are weighed",
            WEIGHING.associate,
            WEIGHING.localise,
            # A search in whole degrees and 5 cm cells leaves half of each; from station to station they add up.
            Config(
                association=AssociationConfig(d2_m=2.0),
                localisation=LocalisationConfig(angle_step_deg=0.1, window=51, cell_m=0.01, refuted=16.0),
            ),
        ),
        Algorithm(
            "graph",
            6,
            "all poses, chains and errors of the wheels in one least-squares problem, solved at every sweep",
            SOLVING.associate,
            SOLVING.localise,
            # What is narrow, merged or seen briefly counts by how good its bearing is; it need not be left out.
            Config(
                reliability=ReliabilityConfig(
                    strong_width_deg=14.0, merged_width_deg=60.0, driving=DrivingConfig(strong_sigma_deg=4.0)
                ),
                localisation=FINE,
            ),
        ),
    )
}
DEFAULT = "graph"


def algorithm(name: str) -> Algorithm:
    """The algorithm of that name. Raises SlamError listing the known ones."""
    if name not in ALGORITHMS:
        raise SlamError(f"no algorithm {name!r}; there are {', '.join(ALGORITHMS)}")
    return ALGORITHMS[name]
