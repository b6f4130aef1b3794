"""What association and localisation remember from sweep to sweep: poses, chains, and the graph of both."""

from dataclasses import dataclass, field

from slam.association import Chains
from slam.geometry import Pose
from slam.graph.problem import Graph


@dataclass(frozen=True)
class Track:
    """All sweeps' poses as they are known now, and every wall at those poses in its chain.

    `graph` is what an algorithm that solves for all poses at once knows of them; empty with the others.
    """

    poses: tuple[Pose, ...] = ()
    chains: Chains = field(default_factory=Chains)
    graph: Graph = field(default_factory=Graph.empty)
