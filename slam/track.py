"""What association and localisation remember from sweep to sweep: poses, chains, and the graph of both."""

from dataclasses import dataclass, field

from slam.association import Chains
from slam.geometry import Pose
from slam.graph.problem import Graph


@dataclass(frozen=True)
class Rival:
    """The same sweeps as they are if odometry is corrected, and what is learnt of the wheels then: drift in rad/m.

    `graph` is all that was seen, with its poses.
    """

    poses: tuple[Pose, ...] = ()
    chains: Chains = field(default_factory=Chains)
    graph: Graph = field(default_factory=Graph.empty)
    distance_scale: float = 0.0
    drift: float = 0.0


@dataclass(frozen=True)
class Track:
    """All sweeps' poses as they are known now, and every wall at those poses in its chain.

    `graph` is what an algorithm that solves for all poses at once knows of them; empty with the others. As long as one
    takes odometry as it is, there is a `rival` that corrects it, and `graph` is what was seen from odometry's poses.
    """

    poses: tuple[Pose, ...] = ()
    chains: Chains = field(default_factory=Chains)
    graph: Graph = field(default_factory=Graph.empty)
    rival: Rival | None = None
