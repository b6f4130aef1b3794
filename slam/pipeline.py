"""The whole algorithm on one page: Fig. 5 of the paper, one block a line, and its letter when it is done."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from slam.algorithms import Algorithm
from slam.association import Association, Chains
from slam.features import Features, extract_features
from slam.frontier import Decision, next_goal
from slam.geometry import Pose
from slam.grid import Grid, Patch
from slam.intent import Intent
from slam.localisation import Localisation
from slam.map_extension import Map, extend_map
from slam.motion import Wheels
from slam.post_calibration import Posed, post_calibrate
from slam.reliability import Reliability, analyse_reliability
from slam.self_calibration import Calibrated, Calibration, Last, self_calibrate
from slam.sweep import SonarRing, Sweep
from slam.track import Track

Hear = Callable[[str], None]
"""Someone who hears the letter of each block of Fig. 5 as it is done; "A" when a sweep comes in."""


@dataclass(frozen=True)
class State:
    """What one sweep hands to the next: the track so far, what is known of the robot, the map, and what it is after."""

    track: Track
    wheels: Wheels | None
    session: int
    calibration: Calibration
    map: Map
    intent: Intent = field(default_factory=Intent)

    @property
    def poses(self) -> tuple[Pose, ...]:
        """All sweeps' poses as they are known now."""
        return self.track.poses

    @property
    def chains(self) -> Chains:
        """All walls as they are known now."""
        return self.track.chains

    @property
    def grid(self) -> Grid:
        """The occupancy grid so far."""
        return self.map.grid

    def last(self, session: int) -> Last | None:
        """The sweep before, as one of that session sees it; None before the first."""
        if not self.poses or self.wheels is None:
            return None
        return Last(self.wheels, self.poses[-1], joined=session == self.session)


@dataclass(frozen=True)
class Step:
    """What every block made of one sweep; `state` is what the next sweep starts from."""

    sweep: Sweep  # A
    calibrated: Calibrated  # B
    reliability: Reliability  # C
    features: Features  # D
    association: Association  # E
    localisation: Localisation  # F
    posed: Posed  # G
    patch: Patch  # H
    decision: Decision  # I
    state: State

    @property
    def pose(self) -> Pose:
        """The corrected pose of the sweep's frame in the map."""
        return self.localisation.pose


def first_state(ring: SonarRing, algorithm: Algorithm) -> State:
    """Before the first sweep: an empty map, nothing known."""
    grid = algorithm.config.map
    return State(
        track=Track(),
        wheels=None,
        session=0,
        calibration=Calibration.unknown(len(ring.mountings)),
        map=Map(Grid(grid.cell_m, grid.occupied_from, grid.free_from)),
    )


def unheard(block: str) -> None:
    """Nobody listens."""


def step(state: State, sweep: Sweep, ring: SonarRing, algorithm: Algorithm, done: Hear = unheard) -> Step:
    """One sweep through the blocks of Fig. 5, each of which `done` hears."""
    config = algorithm.config
    done("A")
    calibrated = self_calibrate(sweep, ring, state.last(sweep.session), state.calibration, config.self_calibration)
    done("B")
    reliability = analyse_reliability(calibrated, config.reliability)
    done("C")
    features = extract_features(reliability, config.features)
    done("D")
    association = algorithm.associate(calibrated, features.walls, state.track, config)
    done("E")
    localisation, track, learnt = algorithm.localise(calibrated, features.walls, association, state.track, config)
    done("F")
    posed = post_calibrate(calibrated, reliability, features, localisation.pose)
    done("G")
    extended, patch = extend_map(state.map, calibrated, reliability, features, track.chains, track.poses, config.map)
    done("H")
    # Where odometry was interrupted it was not what stands there that stopped the robot.
    before = state.intent if calibrated.joined else replace(state.intent, leg=None)
    decision, intent = next_goal(extended.grid, track.poses, before, config.frontier, _nearest_m(reliability, sweep))
    done("I")
    after = State(track, calibrated.wheels, sweep.session, learnt, extended, intent)
    return Step(sweep, calibrated, reliability, features, association, localisation, posed, patch, decision, after)


def _nearest_m(reliability: Reliability, sweep: Sweep) -> float:
    """How far the nearest thing is that answered a turn about a full circle; nobody knows where the robot drove on."""
    if sweep.kind != "scan":
        return 0.0
    return min((rcd.distance for rcd in reliability.rcds), default=np.inf)


def run(
    sweeps: Iterable[Sweep],
    ring: SonarRing,
    algorithm: Algorithm,
    state: State | None = None,
    done: Hear = unheard,
) -> Iterator[Step]:
    """Step after step, as the sweeps come; `done` hears every block of each."""
    state = state or first_state(ring, algorithm)
    for sweep in sweeps:
        result = step(state, sweep, ring, algorithm, done)
        state = result.state
        yield result
