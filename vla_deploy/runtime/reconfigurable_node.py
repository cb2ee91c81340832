"""Let a node follow profile changes and budget directives between two of its steps."""

import logging
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Protocol

from drivers.clock import NS_PER_S, Clock
from platforms import Profile
from platforms.profile import profile_from
from platforms.profile_source import ProfileSource
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.ipc.payloads.supervision import (
    AnsweredPhaseName,
    PrepareProfile,
    ProfileChangeMessage,
    WatchProfile,
)
from vla_deploy.runtime.node import Adaptable, NeedsRestart, Node, Slowable
from vla_deploy.runtime.rate_monitor import RateMonitor, TrialMonitor

TIER_RETRY_NS: Final = 30 * NS_PER_S
_UNSLOWED: Final = "control"
_log = logging.getLogger(__name__)


class Host(Protocol):
    """Run this process as a profile says."""

    def obstacles(self, profile: Profile) -> tuple[str, ...]:
        """Return what would be refused."""
        ...

    def apply(self, profile: Profile) -> tuple[str, ...]:
        """Apply what is permitted, and return what was refused."""
        ...


@dataclass(slots=True, kw_only=True)
class _Change:
    """Follow one change; `way_back` is what a commit has replaced."""

    change_id: int
    future: "Future[tuple[Profile, Any]]"
    answered: bool = False
    way_back: "tuple[Profile, Any] | None" = None


class ReconfigurableNode:
    """Wrap a node; the supervisor's topics say when it prepares, commits, or goes back.

    Preparation runs in `executor`; everything else happens between two steps of the node.
    """

    def __init__(
        self,
        name: str,
        node: Node,
        profile: Profile,
        *,
        ipc: Path,
        clock: Clock,
        host: Host,
        executor: Executor,
    ) -> None:
        self._name = name
        self._node = node
        self._profile = profile
        self._ipc = ipc
        self._clock = clock
        self._host = host
        self._executor = executor
        self._rate_ratio = 1.0
        self._pace = RateMonitor()
        self._tier = self._wanted_tier = 0
        self._tier_loading = 0
        self._tier_due_ns = 0
        self._tier_future: Future[tuple[Profile, Any]] | None = None
        self._directives_sequence = -1
        self._change: _Change | None = None
        self._watch: TrialMonitor | None = None

    @property
    def period_s(self) -> float:
        """Return the time between two steps; a slowed process has a longer one."""
        return self._node.period_s / self._rate_ratio

    @property
    def profile(self) -> Profile:
        """Return the profile that the node runs under."""
        return self._profile

    def start(self) -> None:
        """Start the node and listen from now on."""
        self._node.start()
        self._space = SharedSpace(self._ipc, self._clock)
        self._changes = self._space.ring_reader(topics.PROFILE_CHANGE, from_start=False)
        self._answers = self._space.ring_writer(topics.PROFILE_ANSWER)
        self._directives = self._space.cell_reader(topics.RESOURCE_DIRECTIVES)

    def step(self) -> None:
        """Follow what the supervisor says, then step the node."""
        for event in self._changes.drain():
            self._follow(event.payload)
        self._tell_prepared()
        if self._name != _UNSLOWED:
            self._heed_directives()
        self._pace.note(self._clock.now_ns(), self.period_s)
        self._node.step()
        if self._watch is not None:
            self._watch.note()

    def stop(self) -> None:
        """Stop the node; what is being prepared is given up."""
        self._node.stop()
        self._executor.shutdown(wait=False, cancel_futures=True)
        if hasattr(self, "_space"):
            self._space.close()

    # --- phases of a change -------------------------------------------------------------------

    def _follow(self, message: ProfileChangeMessage) -> None:
        match message["phase"]:
            case "prepare":
                self._on_prepare(message)
            case "commit":
                self._on_commit(message)
            case "watch":
                self._on_watch(message)
            case "validate":
                self._on_validate(message)
            case "keep":
                self._on_keep(message)
            case "rollback":
                self._on_rollback(message)

    def _on_prepare(self, message: PrepareProfile) -> None:
        self._abandon()
        source = ProfileSource.of_values(message["profile"], message["values"])
        future = self._executor.submit(self._prepare, source, self._tier)
        self._change = _Change(change_id=message["change_id"], future=future)

    def _prepare(self, source: ProfileSource, tier: int) -> tuple[Profile, Any]:
        profile = profile_from(source)
        known = self._host.obstacles(self._profile)
        new = [text for text in self._host.obstacles(profile) if text not in known]
        if new:
            raise NeedsRestart("; ".join(new))
        return profile, self._prepared(profile, tier)

    def _prepared(self, profile: Profile, tier: int) -> Any:
        node = self._node
        return node.prepare(profile, tier) if isinstance(node, Adaptable) else None

    def _tell_prepared(self) -> None:
        change = self._change
        if change is None or change.answered or not change.future.done():
            return
        change.answered = True
        error = change.future.exception()
        if error is None:
            self._answer(change.change_id, "prepare", "")
            return
        self._answer(
            change.change_id, "prepare", _one_line(error), restart=isinstance(error, NeedsRestart)
        )
        self._change = None

    def _on_commit(self, message: ProfileChangeMessage) -> None:
        change = self._of(message)
        if change is None or not change.answered:
            self._answer(message["change_id"], "commit", "it has prepared nothing")
            return
        before = self._profile
        kept_ratio = self._pace.ratio
        change.way_back = before, self._switch(change.future.result())
        refused = [
            text
            for text in self._host.apply(self._profile)
            if text not in self._host.obstacles(before)
        ]
        self._begin_watch(change.change_id, kept_ratio)
        self._answer(change.change_id, "commit", "; ".join(refused))

    def _on_watch(self, message: WatchProfile) -> None:
        """Count from now on if this process has been started for the change, or was slow once."""
        kept_ratio = message["restarted"].get(self._name)
        if kept_ratio is not None:
            self._begin_watch(message["change_id"], kept_ratio)
        elif self._watch is not None and self._name in message["again"]:
            self._watch.again(self._clock.now_ns())

    def _begin_watch(self, change_id: int, kept_ratio: float) -> None:
        self._watch = TrialMonitor(change_id, self._clock.now_ns(), kept_ratio / self.period_s)

    def _on_validate(self, message: ProfileChangeMessage) -> None:
        watch, change_id = self._watch, message["change_id"]
        if watch is None or watch.change_id != change_id:
            self._answer(change_id, "validate", "it has committed nothing")
            return
        self._answer(change_id, "validate", watch.fault(self._clock.now_ns(), self.period_s))

    def _on_keep(self, message: ProfileChangeMessage) -> None:
        change = self._of(message)
        if change is not None and change.way_back is not None:
            self._discard(change.way_back[1])
        self._change = self._watch = None

    def _on_rollback(self, message: ProfileChangeMessage) -> None:
        change = self._of(message)
        if change is not None and change.way_back is not None:
            self._discard(self._switch(change.way_back))
            self._host.apply(self._profile)
            self._change = None
        self._watch = None
        self._abandon()
        self._answer(message["change_id"], "rollback", "")

    def _switch(self, prepared: tuple[Profile, Any]) -> Any:
        """Put the node under a prepared profile; return what that replaced."""
        self._profile, content = prepared
        return self._node.commit(content) if isinstance(self._node, Adaptable) else None

    def _abandon(self) -> None:
        """Forget a preparation; one that still runs is discarded as soon as it is done."""
        change, self._change = self._change, None
        if change is not None:
            change.future.add_done_callback(self._discard_done)

    def _discard_done(self, future: "Future[tuple[Profile, Any]]") -> None:
        if not future.cancelled() and future.exception() is None:
            self._discard(future.result()[1])

    def _discard(self, content: Any) -> None:
        if isinstance(self._node, Adaptable):
            self._node.discard(content)

    def _of(self, message: ProfileChangeMessage) -> _Change | None:
        change = self._change
        return change if change is not None and change.change_id == message["change_id"] else None

    def _answer(
        self, change_id: int, phase: AnsweredPhaseName, reason: str, *, restart: bool = False
    ) -> None:
        self._answers.publish(
            {
                "change_id": change_id,
                "process": self._name,
                "phase": phase,
                "ok": not reason,
                "reason": reason[:1000],
                "restart": restart,
                "pace_ratio": self._pace.ratio,
            }
        )

    # --- budgets ------------------------------------------------------------------------------

    def _heed_directives(self) -> None:
        sample = self._directives.latest()
        if sample is not None and sample.sequence != self._directives_sequence:
            self._directives_sequence = sample.sequence
            document = sample.document()
            self._rate_ratio = float(document.get("rate_ratio", {}).get(self._name, 1.0))
            if isinstance(self._node, Slowable):
                self._node.slow(self._rate_ratio)
            self._wanted_tier = int(document.get("model_tier", {}).get(self._name, 0))
        if self._change is None:
            self._follow_tier()

    def _follow_tier(self) -> None:
        """Take the models of the wanted tier; what failed is tried again after a while."""
        is_due = self._clock.now_ns() >= self._tier_due_ns
        if self._tier_future is None and self._tier != self._wanted_tier and is_due:
            self._load_tier(self._wanted_tier)
        if self._tier_future is not None and self._tier_future.done():
            self._take_tier(self._tier_future)
            self._tier_future = None

    def _load_tier(self, tier: int) -> None:
        profile = self._profile
        self._tier_loading = tier
        self._tier_future = self._executor.submit(lambda: (profile, self._prepared(profile, tier)))

    def _take_tier(self, future: "Future[tuple[Profile, Any]]") -> None:
        error, tier = future.exception(), self._tier_loading
        if error is not None:
            self._tier_due_ns = self._clock.now_ns() + TIER_RETRY_NS
            retry = f"tried again after {TIER_RETRY_NS / NS_PER_S:g} s"
            _log.warning("degraded: no models of tier %d: %s; %s", tier, _one_line(error), retry)
        elif future.result()[0] is self._profile and tier == self._wanted_tier:
            self._discard(self._switch(future.result()))
            self._tier = tier
        else:
            self._discard(future.result()[1])


def _one_line(error: BaseException) -> str:
    return str(error).replace("\n", "; ") or type(error).__name__
