"""Follow what the robot is told and what comes of it, and put that into the memory."""

import logging
import math
from collections import OrderedDict
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future, wait
from dataclasses import dataclass, field, replace
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import Event, SharedSpace, topics
from vla_deploy.ipc.payloads.tasks import MemoryStatus, TaskEvent, Utterance
from vla_deploy.memory.actions import past_actions
from vla_deploy.memory.episode import Episode, EpisodeOutcome, LastSeen
from vla_deploy.memory.errors import MemoryUnusable
from vla_deploy.memory.judgement import Judgement, read_judgement
from vla_deploy.memory.store import MemoryStore
from vla_deploy.world import SceneUnreadable, Snapshot, Thing, read_snapshot
from vla_deploy.world.memory import Point, place_of
from vla_deploy.world.vocabulary import ANY_CLASS

# What is under way is bounded: a command whose end is never told is dropped for newer ones.
MOST_OPEN: Final = 32
# A thing is written again where it has moved so far, or after so long.
MOVED_M: Final = 0.2
AGAIN_S: Final = 60.0
LOOK_EVERY_NS: Final = 2 * NS_PER_S
_RETRY_NS: Final = 30 * NS_PER_S
_MOST_KEPT: Final = 200
# A long run names many things anew, perception tells 64 at once: those not seen for longest are
# dropped here, not from the file.
MOST_THINGS: Final = 512
_ENDS: Final = frozenset({"rejected", "finished", "answered"})
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Batch:
    """Hold what is written in one act."""

    episodes: list[Episode] = field(default_factory=list)
    things: dict[str, LastSeen] = field(default_factory=dict)
    judged: list[tuple[Episode, Judgement]] = field(default_factory=list)


class MemoryKeeper:
    """Read the topics in steps; write beside them. `wall_s` gives seconds since 1970."""

    def __init__(
        self,
        store: MemoryStore,
        space: SharedSpace,
        clock: Clock,
        executor: Executor,
        *,
        run_id: str,
        places: Mapping[str, Point],
        wall_s: Callable[[], float],
    ) -> None:
        self._store = store
        self._clock = clock
        self._executor = executor
        self._run_id = run_id
        self._places = dict(places)
        self._wall_s = wall_s
        self._utterances = space.ring_reader(topics.UTTERANCE, from_start=False)
        self._events = space.ring_reader(topics.TASK_EVENT, from_start=False)
        self._scene = space.cell_reader(topics.SCENE)
        self._open: OrderedDict[str, Episode] = OrderedDict()
        self._ended: list[Episode] = []
        self._last: Episode | None = None
        self._judged: list[tuple[Episode, Judgement]] = []
        self._seen: OrderedDict[str, LastSeen] = OrderedDict()
        self._changed: dict[str, LastSeen] = {}
        self._writing: Future[None] | None = None
        self._batch = _Batch()
        self._look_due_ns = 0
        self._write_due_ns = 0
        self.trouble = ""

    def step(self) -> None:
        """Take note of what has come in, and write what is complete."""
        heard = self._utterances.drain()
        for said in heard:
            self._begin(said)
        for event in self._events.drain():
            self._follow(event.payload)
        for said in heard:  # once it is known what has ended by now
            self._judge(said.payload)
        now_ns = self._clock.now_ns()
        if now_ns >= self._look_due_ns:
            self._look_due_ns = now_ns + LOOK_EVERY_NS
            self._look(now_ns)
        self._write(now_ns)

    def close(self) -> None:
        """Write what is complete, and release the file."""
        self._write_due_ns = 0
        if self._writing is not None:
            wait([self._writing])
        self._write(self._clock.now_ns())
        self._executor.shutdown(wait=True)
        self._store.close()

    def document(self) -> MemoryStatus:
        """Return how remembering goes, for the status."""
        waiting = len(self._ended) + len(self._changed) + len(self._judged)
        return {"file": str(self._store.path), "waiting": waiting, "trouble": self.trouble}

    # --- commands -------------------------------------------------------------------------------

    def _begin(self, event: Event[Utterance]) -> None:
        told = event.payload
        command_id, text = str(told.get("command_id", "")), str(told.get("text") or "")
        if not command_id or not text:  # a cancel, or a whole plan from a program
            return
        if read_judgement(text) is not None:  # of another command
            return
        self._open[command_id] = Episode(
            told_s=self._wall_s(),
            command=text,
            outcome=EpisodeOutcome.REFUSED,
            source=str(told.get("source", "")),
        )
        while len(self._open) > MOST_OPEN:
            self._open.popitem(last=False)

    def _follow(self, told: TaskEvent) -> None:
        command_id = told["command_id"]
        before = self._open.get(command_id)
        episode = None if before is None else _after(told, before)
        if episode is None:
            return
        if told["event"] not in _ENDS:
            self._open[command_id] = episode
            return
        del self._open[command_id]
        now_s = self._wall_s()
        actions = (
            past_actions(told.get("actions", ()), now_s) if told["event"] == "finished" else ()
        )
        elapsed_s = max(0.0, now_s - episode.told_s)
        self._last = replace(episode, duration_s=round(elapsed_s, 1), actions=actions)
        self._ended.append(self._last)
        del self._ended[:-_MOST_KEPT]

    def _judge(self, told: Utterance) -> None:
        """Let a person correct what came of the command that ended last, if surely understood."""
        judgement = read_judgement(str(told.get("text") or ""))
        is_doubted = told.get("heard", {}).get("doubted", False)
        if judgement is not None and self._last is not None and not is_doubted:
            self._judged.append((self._last, judgement))
            del self._judged[:-_MOST_KEPT]

    # --- things ---------------------------------------------------------------------------------

    def _look(self, now_ns: int) -> None:
        sample = self._scene.latest()
        if sample is None:
            return
        try:
            snapshot = read_snapshot(sample.document(), now_ns)
        except SceneUnreadable as error:  # perception's fault; it is told there, too
            _log.warning("%s", error)
            return
        for thing in snapshot.things:
            if thing.kind != ANY_CLASS:
                self._note(thing, snapshot)
        while len(self._seen) > MOST_THINGS:
            gone, _ = self._seen.popitem(last=False)
            self._changed.pop(gone, None)

    def _note(self, thing: Thing, snapshot: Snapshot) -> None:
        seen = LastSeen(
            run_id=self._run_id,
            thing_id=thing.thing_id,
            kind=thing.kind,
            colour=thing.colour,
            place=place_of(thing, self._places),
            position_m=thing.position_m,
            seen_s=self._wall_s() - snapshot.unseen_s(thing),
        )
        before = self._seen.get(thing.thing_id)
        if before is None or _is_news(before, seen):
            self._seen[thing.thing_id] = self._changed[thing.thing_id] = seen
        self._seen.move_to_end(thing.thing_id)

    # --- writing --------------------------------------------------------------------------------

    def _write(self, now_ns: int) -> None:
        """Hand over what is new; what could not be written is tried again later."""
        if self._writing is not None:
            if not self._writing.done():
                return
            self._settle(self._writing, now_ns)
        if now_ns < self._write_due_ns or not (self._ended or self._changed or self._judged):
            return
        batch = _Batch(episodes=self._ended, things=self._changed, judged=self._judged)
        self._batch = batch
        self._ended, self._changed, self._judged = [], {}, []
        things = list(batch.things.values())
        self._writing = self._executor.submit(self._store.add, batch.episodes, things, batch.judged)

    def _settle(self, writing: "Future[None]", now_ns: int) -> None:
        self._writing = None
        error = writing.exception()
        if error is None:
            self.trouble = ""
            return
        if not isinstance(error, MemoryUnusable):
            raise error
        if not self.trouble:
            _log.warning("not remembered for now: %s", error)
        self.trouble = str(error)
        self._write_due_ns = now_ns + _RETRY_NS
        batch = self._batch
        self._ended = [*batch.episodes, *self._ended][-_MOST_KEPT:]
        self._judged = [*batch.judged, *self._judged][-_MOST_KEPT:]
        waiting = {**batch.things, **self._changed}
        self._changed = {name: seen for name, seen in waiting.items() if name in self._seen}


def _is_news(before: LastSeen, now: LastSeen) -> bool:
    return (
        (before.kind, before.colour, before.place) != (now.kind, now.colour, now.place)
        or math.dist(before.position_m, now.position_m) > MOVED_M
        or now.seen_s - before.seen_s > AGAIN_S
    )


def _after(told: TaskEvent, episode: Episode) -> Episode | None:
    """Return the episode after an event of its command, None where the event says nothing of it."""
    if told["event"] == "plan":
        plan = told["plan"]
        goal, reasoning = str(plan.get("goal", "")), str(plan.get("reasoning", ""))
        rung = told.get("rung", "")
        return replace(episode, goal=goal, reasoning=reasoning, plan=plan, rung=rung)
    if told["event"] == "rejected":
        return replace(episode, outcome=EpisodeOutcome.REFUSED, error=told.get("reason") or "")
    if told["event"] == "finished":
        outcome = EpisodeOutcome.SUCCEEDED if told.get("success") else EpisodeOutcome.FAILED
        return replace(episode, outcome=outcome, error=told.get("error") or "")
    if told["event"] == "answered":  # It answered a question: what came of it is told of that.
        return replace(episode, outcome=EpisodeOutcome.SUCCEEDED)
    return None
