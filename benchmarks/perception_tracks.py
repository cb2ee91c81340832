"""Judge the memory of things beside the twin's truth: ids, relations, what is found again.

The whole robot works in lock-step. `jobs` are pick-and-place runs in which every told scene is
compared with where things really are. In `moves` a thing changes its place while the robot looks
away. In `arrangements` things stand at random on, in and beside each other, and what the scene says
of them is compared with the same rules applied to their true places. `update` is the tracker alone.
"""

import math
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.command import parser, show
from benchmarks.table_of_things import SHAPES, draw_arrangement, true_snapshot
from sim_twin.harness.lockstep_stack import LockstepStack, armed_lockstep
from vla_deploy.ipc import topics
from vla_deploy.perception.images.detection import Detection
from vla_deploy.perception.naming.class_fusion import NameSource
from vla_deploy.perception.objects.filtering import Estimate
from vla_deploy.perception.objects.matching import assign
from vla_deploy.perception.objects.track import Sighting
from vla_deploy.perception.objects.tracker import Tracker
from vla_deploy.world import Snapshot, read_snapshot, relations_of

JOB: Final = "pick up the red cup and put it in the box"
SETTLE_S: Final = 2.0
THINGS, UPDATES = 20, 200

GATE_M = 0.15
"""A told thing farther from every real one is none of them."""


@dataclass(slots=True)
class IdentityWatch:
    """Count per real thing under how many ids it went, as CLEAR MOT counts switches.

    A thing goes by the id that it had as long as that one is told near it; only then by another.
    """

    ids: dict[str, str] = field(default_factory=dict)
    switches: list[str] = field(default_factory=list)
    looks: int = 0
    followed: int = 0
    false_things: int = 0

    def look(self, told: Sequence[Mapping[str, Any]], real: Mapping[str, Any]) -> None:
        """Compare one told scene with the truth's objects."""
        things = {str(one["id"]): one["position_m"] for one in told}
        bodies = {name: body["position_m"] for name, body in real.items()}
        kept = {
            name: known
            for name, known in self.ids.items()
            if known in things and math.dist(things[known], bodies[name]) < GATE_M
        }
        found = kept | self._new_pairs(
            {name: at for name, at in things.items() if name not in kept.values()},
            {name: at for name, at in bodies.items() if name not in kept},
        )
        for name, thing in found.items():
            before = self.ids.get(name)
            if before not in (None, thing):
                self.switches.append(f"{name}: {before} -> {thing}")
        self.ids |= found
        self.looks += 1
        self.followed += len(found)
        self.false_things += len(things) - len(found)

    @staticmethod
    def _new_pairs(
        things: Mapping[str, Sequence[float]], bodies: Mapping[str, Sequence[float]]
    ) -> dict[str, str]:
        apart = [[math.dist(at, there) for there in things.values()] for at in bodies.values()]
        pairs = assign(np.array(apart).reshape(len(bodies), len(things)), GATE_M)
        names, ids = list(bodies), list(things)
        return {names[row]: ids[column] for row, column in pairs}


class SceneWatcher:
    """Compare what perception tells with the truth, ten times a second."""

    period_s = 0.1

    def __init__(self, stack: LockstepStack) -> None:
        self.identities = IdentityWatch()
        self._stack = stack
        self._scene = stack.space.cell_reader(topics.SCENE)

    def start(self) -> None:
        """Have nothing to open."""

    def step(self) -> None:
        """Take in one scene."""
        sample = self._scene.latest()
        if sample is not None:
            real = self._stack.lockstep.truth()["objects"]
            self.identities.look(sample.document()["objects"], real)

    def stop(self) -> None:
        """Release the topic."""
        self._scene.close()


def measure(jobs: int = 3, moves: int = 8, arrangements: int = 12, seed: int = 0) -> dict[str, Any]:
    """Return what became of ids in jobs, of moved things and relations, and the CPU per update.

    Raises:
        OpenGLMissing: nothing can be rendered on this machine.
    """
    return {
        "jobs": _jobs(jobs, seed),
        "moved_unseen": _moves(moves, seed),
        "relations": _relations(arrangements, seed),
        "update": _update_cost(seed),
    }


def _jobs(count: int, seed: int) -> dict[str, Any]:
    watches, done = [], 0
    for number in range(seed, seed + count):
        with _stack(number) as stack:
            watcher = SceneWatcher(stack)
            stack.lockstep.add(watcher)
            done += bool(stack.say(JOB).get("success"))
            watches.append(watcher.identities)
    looks = sum(watch.looks for watch in watches)
    return {
        "count": count,
        "succeeded": done,
        "id_switches": sum(len(watch.switches) for watch in watches),
        "things_followed_mean": round(sum(watch.followed for watch in watches) / max(1, looks), 3),
        "false_things_mean": round(sum(w.false_things for w in watches) / max(1, looks), 3),
    }


def _moves(count: int, seed: int) -> dict[str, Any]:
    """Move the cup along its table while the robot has its back to it."""
    random = np.random.default_rng(seed)
    found = kept = 0
    with _stack(seed) as stack:
        stack.say("go to the coffee table")
        for _ in range(count):
            before = _near_truth(stack, "red_cup")
            stack.say("turn left 90 degrees")
            x_m, y_m = float(random.uniform(1.85, 2.55)), float(random.uniform(1.50, 1.63))
            _place(stack, "red_cup", x_m, y_m, 0.45, 0.0)
            stack.say("turn right 90 degrees")
            stack.say("look down")
            stack.lockstep.run_for(SETTLE_S)
            after = _near_truth(stack, "red_cup")
            found += after is not None
            kept += after is not None and before is not None and before["id"] == after["id"]
    tries = max(1, count)
    return {"count": count, "found_ratio": found / tries, "same_id_ratio": kept / tries}


def _relations(count: int, seed: int) -> dict[str, Any]:
    random = np.random.default_rng(seed)
    right = told_only = real_only = 0
    by_word: dict[str, list[int]] = {}
    with _stack(seed) as stack:
        stack.say("go to the coffee table")
        stack.say("look down")
        for _ in range(count):
            for name, pose in draw_arrangement(random).items():
                _place(stack, name, *pose)
            stack.lockstep.run_for(SETTLE_S)
            told, real = _both(stack)
            right += len(told & real)
            told_only += len(told - real)
            real_only += len(real - told)
            for relation in told | real:
                row = by_word.setdefault(relation[1], [0, 0])
                row[0] += relation in told and relation in real
                row[1] += 1
    return {
        "arrangements": count,
        "precision": right / max(1, right + told_only),
        "recall": right / max(1, right + real_only),
        "agreed_per_word": {word: f"{a} of {n}" for word, (a, n) in sorted(by_word.items())},
    }


def _both(stack: LockstepStack) -> tuple[set[tuple[str, ...]], set[tuple[str, ...]]]:
    """Return the relations told and the real ones, of the things that were seen, by real names."""
    told = read_snapshot(_document(stack))
    real = true_snapshot(stack.lockstep.truth())
    watch = IdentityWatch()
    watch.look(_document(stack)["objects"], stack.lockstep.truth()["objects"])
    names = {thing: name for name, thing in watch.ids.items() if name in SHAPES}
    return _among(told, names), _among(real, {name: name for name in names.values()})


def _among(snapshot: Snapshot, names: Mapping[str, str]) -> set[tuple[str, ...]]:
    return {
        (names[one.subject], one.relation, names[one.other])
        for one in relations_of(snapshot)
        if one.subject in names and one.other in names
    }


def _update_cost(seed: int) -> dict[str, Any]:
    """Time the tracker on twenty things that are all seen, with noise."""
    random = np.random.default_rng(seed)
    places = random.uniform((0.0, 0.0, 0.4), (5.0, 5.0, 0.6), (THINGS, 3))
    tracker, times_s = Tracker(), []
    for update in range(UPDATES):
        stamp_ns = update * 200_000_000
        sightings = [
            _sighting(at + random.normal(0.0, 0.005, 3), number, stamp_ns)
            for number, at in enumerate(places)
        ]
        began_s = time.thread_time()
        tracker.update(sightings, (), stamp_ns)
        times_s.append(time.thread_time() - began_s)
    p50_s, p95_s = np.percentile(times_s[UPDATES // 10 :], (50, 95))
    return {
        "things": THINGS,
        "tracked": len(tracker.objects),
        "cpu_p50_ms": round(1e3 * float(p50_s), 3),
        "cpu_p95_ms": round(1e3 * float(p95_s), 3),
    }


def _sighting(at: np.ndarray, number: int, stamp_ns: int) -> Sighting:
    x_m, y_m, z_m = (float(value) for value in at)
    detection = Detection(
        class_name=("cup", "ball", "book", "bottle")[number % 4],
        colour=("red", "blue", "green")[number % 3],
        position_m=(x_m, y_m, z_m),
        size_m=(0.07, 0.07, 0.1),
        yaw_rad=0.0,
        confidence=0.9,
        truncated=False,
        occluded=False,
        box_px=(0, 0, 10, 10),
        covariance_m2=((1e-4, 0.0, 0.0), (0.0, 1e-4, 0.0), (0.0, 0.0, 1e-4)),
        size_sigma_m=(0.01, 0.01, 0.01),
        yaw_sigma_rad=0.1,
        named_by=NameSource.FORM,
    )
    seen = Estimate(position_m=at, covariance_m2=1e-4 * np.eye(3), stamp_ns=stamp_ns)
    return Sighting(detection, seen)


def _near_truth(stack: LockstepStack, name: str) -> Mapping[str, Any] | None:
    """Return what the scene tells at a thing's true place."""
    at = stack.lockstep.truth()["objects"][name]["position_m"]
    near: list[Mapping[str, Any]] = [
        one
        for one in _document(stack)["objects"]
        if math.dist(one["position_m"], at) < 0.5 * GATE_M
    ]
    return min(near, key=lambda one: math.dist(one["position_m"], at), default=None)


def _document(stack: LockstepStack) -> Mapping[str, Any]:
    sample = stack.space.cell_reader(topics.SCENE).latest()
    assert sample is not None, "perception has told a scene by now"
    return sample.document()


def _place(
    stack: LockstepStack, name: str, x_m: float, y_m: float, on_m: float, yaw_rad: float
) -> None:
    z_m = on_m + SHAPES[name].origin_m
    stack.lockstep.twin.engine.place(name, x_m, y_m, z_m, yaw_rad)


@contextmanager
def _stack(seed: int) -> Iterator[LockstepStack]:
    with (
        tempfile.TemporaryDirectory() as folder,
        armed_lockstep(Path(folder), seed=seed) as stack,
    ):
        yield stack


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures."""
    arguments = parser("perception --part tracks", __doc__)
    arguments.add_argument("--jobs", type=int, default=3, help="pick-and-place runs")
    arguments.add_argument("--moves", type=int, default=8, help="of a cup behind the robot's back")
    arguments.add_argument("--arrangements", type=int, default=12, help="of things on a table")
    arguments.add_argument("--seed", type=int, default=0)
    given = arguments.parse_args(argv)
    figures = measure(given.jobs, given.moves, given.arrangements, given.seed)
    show(figures, as_json=given.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
