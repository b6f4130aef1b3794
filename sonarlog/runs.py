"""Runs: what one replay of one recording with one algorithm and configuration made, as an MCAP file.

The file opens in Rerun and Foxglove by itself (map, path, walls, text) and holds every step's values and digests.
What must be equal on every machine stands in the metadata `run`, facts about the machine in `machine` and `times`.
"""

import io
import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from slam.algorithms import Algorithm
from slam.association import Chains
from slam.config import settings
from slam.geometry import Pose
from slam.grid import Grid, Patch
from slam.pipeline import State, Step
from sonarlog.canonical import canonical, joined, parted
from sonarlog.digest import RunDigest
from sonarlog.errors import SonarlogError
from sonarlog.log import Surfaces, Truth
from sonarlog.mcap_file import McapReader, McapWriter
from sonarlog.provenance import code_digest, machine_facts
from sonarlog.robot import Robot
from sonarlog.run_topics import RunTopics
from sonarlog.step_data import chains_of, final_data, final_of, pose_data, pose_of, step_data
from sonarlog.times import TIMES, BlockTimes, times_in

SURFACES = "surfaces.json"
FINAL = "final.json"
VERSION = 1
"""Of the run file; a reader refuses newer ones by name."""

BLOCKS_TOPIC = "/blocks"
CHECKPOINTS_TOPIC = "/checkpoints"
CHECKPOINTS_SCHEMA = "Number of sweeps done (uint32), canonical bytes of slam.pipeline.State: see docs/determinism.md"
BLOCKS_SCHEMA = "Canonical bytes of what each block made of the sweep, by letter: see docs/determinism.md"
STEP_SCHEMA = json.dumps({"type": "object", "title": "sonarlog step", "description": "see docs/runs.md"})


class BadRun(SonarlogError):
    """The file is no run, or one that this version cannot read."""


@dataclass(frozen=True)
class RunIdentity:
    """What decides a run's result: the same identity gives the same digest on every machine."""

    recording_digest: str
    algorithm: str
    algorithm_version: int
    config: dict[str, Any]
    code_digest: str
    robot: dict[str, Any] | None = None  # parameters given instead of the recording's own

    @property
    def given_robot(self) -> Robot | None:
        """The robot that the recording was replayed as, if not its own."""
        return Robot.from_dict(self.robot, "robot of the run") if self.robot else None

    def asked(self) -> dict[str, Any]:
        """What the run's digest begins with: all but the code, for other code may well compute the same."""
        return {
            "recording": self.recording_digest,
            "algorithm": self.algorithm,
            "algorithm_version": self.algorithm_version,
            "config": self.config,
            **({} if self.robot is None else {"robot": self.robot}),
        }


@dataclass(frozen=True)
class SweepResult:
    """One sweep of a run; `digests` by block letter and of the map, `chain` that of everything up to here.

    `data` holds what people ask for; every value of every block is in `read_blocks`.
    """

    index: int
    t_ns: int
    odometry: Pose
    predicted: Pose
    pose: Pose
    truth: Pose | None
    digests: dict[str, str]
    chain: str
    data: dict[str, Any]


@dataclass(frozen=True)
class Run:
    """A run read back.

    `poses` and `chains` are all sweeps' poses and all walls as they were known at the end; the poses as they were found
    at the time stand in `sweeps`. `times` is what the blocks took, if the run keeps it.
    """

    path: Path
    identity: RunIdentity
    counts: dict[str, int]
    machine: dict[str, str]
    digest: str
    map_digest: str
    sweeps: tuple[SweepResult, ...]
    grid: Grid
    surfaces: Surfaces | None
    poses: tuple[Pose, ...]
    chains: Chains
    times: BlockTimes | None = None

    @cached_property
    def truth(self) -> Truth | None:
        """The true poses at the sweeps' reference readings, in the recording's frame, if they are known."""
        poses = [sweep.truth for sweep in self.sweeps]
        known = [(pose.x, pose.y, pose.theta) for pose in poses if pose is not None]
        if not known or len(known) < len(poses):
            return None
        return Truth(np.array([sweep.t_ns for sweep in self.sweeps]), np.array(known))


def identify(recording_digest: str, algorithm: Algorithm, robot: Robot | None = None) -> RunIdentity:
    """The identity of a run of this algorithm, as this code would make it now; `robot` if not the recording's own."""
    asked = settings(algorithm.config)
    given = robot.as_dict() if robot else None
    return RunIdentity(recording_digest, algorithm.name, algorithm.version, asked, code_digest(), given)


class RunWriter:
    """Write a run step by step. A context manager: it finishes the file, or removes it when the block raised.

    Raises what `McapWriter` raises.
    """

    def __init__(
        self,
        path: Path | str,
        identity: RunIdentity,
        *,
        recording: Path | str = "",
        force: bool = False,
        checkpoint_every: int = 0,
    ) -> None:
        """`recording` is where the recording was found: a fact about this machine, kept for `verify`.

        The whole state is kept after every `checkpoint_every` sweeps (0: never).
        """
        self._identity = identity
        self._recording = str(recording)
        self._writer = McapWriter(path, force=force, keep=False)
        self._topics = RunTopics(self._writer)
        self._steps = self._writer.channel("/step", "sonarlog.Step", STEP_SCHEMA, encoding="json")
        self._blocks = self._writer.channel(BLOCKS_TOPIC, "sonarlog.Blocks", BLOCKS_SCHEMA, encoding="canonical")
        self._every = checkpoint_every
        if checkpoint_every:
            self._checkpoints = self._writer.channel(
                CHECKPOINTS_TOPIC, "sonarlog.State", CHECKPOINTS_SCHEMA, encoding="canonical"
            )
        self._count = 0

    def add(self, step: Step, digests: Mapping[str, str], result: RunDigest, truth: Pose | None = None) -> None:
        """Write what the step shows, its values and its digests, which `result` just made.

        `truth` is where the robot really was.
        """
        data = step_data(step, self._count)
        record = {**data, "truth": truth and pose_data(truth), "digests": dict(digests), "chain": result.chain}
        self._writer.write(self._steps, data["t_ns"], json.dumps(record, allow_nan=False).encode())
        self._writer.write(self._blocks, data["t_ns"], joined(result.blocks))
        self._topics.add(step, self._count, result.chain)
        self._count += 1
        if self._every and self._count % self._every == 0:
            state = self._count.to_bytes(4, "little") + canonical(step.state)
            self._writer.write(self._checkpoints, data["t_ns"], state)

    def finish(
        self,
        result: RunDigest,
        state: State,
        counts: Mapping[str, int],
        surfaces: Surfaces | None,
        times: BlockTimes | None = None,
    ) -> None:
        """Write the final map, path and walls, the digests and the metadata, with what the blocks took, if known."""
        run = {
            "version": str(VERSION),
            "identity": json.dumps(asdict(self._identity), sort_keys=True),
            "counts": json.dumps(dict(counts), sort_keys=True),
            "sweeps": str(self._count),
            "map_digest": result.map_digest(),
            "digest": result.result(),
        }
        self._topics.finish()
        self._write_grid(state.grid)
        self._writer.attachment(FINAL, "application/json", json.dumps(final_data(state)).encode())
        if surfaces is not None:
            self._writer.attachment(SURFACES, "application/json", surfaces.to_json())
        self._writer.metadata("run", run)
        self._writer.metadata("machine", machine_facts() | {"recording": self._recording})
        if times is not None:
            self._writer.metadata(TIMES, times.as_metadata())

    def _write_grid(self, grid: Grid) -> None:
        cells, left, bottom = grid.dense()
        place = {
            "cell_m": grid.cell_m,
            "left": left,
            "bottom": bottom,
            "occupied_from": grid.occupied_from,
            "free_from": grid.free_from,
        }
        self._writer.metadata("map", {"place": json.dumps(place)})
        self._writer.attachment("map.npy", "application/x-npy", _npy(cells))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        if kind is None:
            self._writer.finish()
        else:
            self._writer.abandon()


def read_run(path: Path | str) -> Run:
    """Read a run file. Raises CannotRead, NotMcap, and BadRun for a file that holds no whole run."""
    reader = McapReader(path)
    if "run" not in reader.metadata:
        kind = "is a recording, not a run: replay it first" if "recording" in reader.metadata else "holds no run"
        raise BadRun(f"{path} {kind if not reader.damage else 'is incomplete: replay the recording again'}")
    data = reader.metadata["run"]
    if int(data["version"]) > VERSION:
        raise BadRun(f"{path} is a run of version {data['version']}; this sonarlog reads up to version {VERSION}")
    if reader.damage:
        raise BadRun(f"{reader.damage[0]}; replay the recording again")
    surfaces = reader.attachments.get(SURFACES)
    records = [json.loads(message.data) for message in reader.stream(["/step"])]
    final = reader.attachments.get(FINAL)
    if final is not None:
        poses, chains = final_of(json.loads(final.data))
    else:  # runs of the first versions: nothing in them ever moved again
        poses, chains = tuple(pose_of(record["pose"]) for record in records), chains_of(records)
    return Run(
        path=Path(path),
        identity=RunIdentity(**json.loads(data["identity"])),
        counts=json.loads(data["counts"]),
        machine=reader.metadata.get("machine", {}),
        digest=data["digest"],
        map_digest=data["map_digest"],
        sweeps=tuple(_sweep_result(record) for record in records),
        grid=_grid(reader),
        surfaces=Surfaces.from_json(surfaces.data) if surfaces else None,
        poses=poses,
        chains=chains,
        times=times_in(reader.metadata),
    )


def read_blocks(path: Path | str) -> Iterator[dict[str, bytes]]:
    """The canonical bytes of what each block made, by letter, sweep after sweep; nothing from runs that keep none.

    Raises what `read_run` raises.
    """
    for message in McapReader(path).stream([BLOCKS_TOPIC]):
        yield parted(message.data)


def _sweep_result(record: dict[str, Any]) -> SweepResult:
    return SweepResult(
        index=record["sweep"],
        t_ns=record["t_ns"],
        odometry=pose_of(record["odometry"]),
        predicted=pose_of(record["predicted"]),
        pose=pose_of(record["pose"]),
        truth=pose_of(record["truth"]) if record["truth"] else None,
        digests=record["digests"],
        chain=record["chain"],
        data=record,
    )


def _grid(reader: McapReader) -> Grid:
    place = json.loads(reader.metadata["map"]["place"])
    empty = Grid(place["cell_m"], place["occupied_from"], place["free_from"])
    cells = np.load(io.BytesIO(reader.attachments["map.npy"].data))
    return empty.extended(Patch(place["left"], place["bottom"], cells)) if cells.size else empty


def _npy(array: np.ndarray[Any, np.dtype[Any]]) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()
