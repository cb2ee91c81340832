"""Switch profiles again and again while joints move, in the real processes; some profiles are bad.

Control must neither stop nor be later than before, no process may grow with the switches, and a
profile that cannot be kept is refused or taken back, with the robot at work all the while.
"""

import argparse
import itertools
import os
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from drivers.clock import NS_PER_S
from sim_twin.campaigns.report import CampaignCase, CampaignReport, told
from sim_twin.campaigns.selection import chosen
from sim_twin.campaigns.switching.commit_second import CommitLook, commit_ns, explained, late_around
from sim_twin.campaigns.switching.host_stalls import HostStallMonitor
from sim_twin.campaigns.switching.judge import SwitchSeen, judge, memory_case, ticks_case
from sim_twin.campaigns.switching.profiles import BAD, GOOD, Bad, control_rate_hz
from sim_twin.campaigns.ticks import TickWatch
from sim_twin.campaigns.working_robot import WorkingRobot
from sim_twin.harness.robot import RobotFailed
from vla_deploy.ipc import topics
from vla_deploy.robots import load_robot

SWITCHES: Final = 100
_BEFORE_S: Final = 10.0
_AFTER_BAD_S: Final = 2.0
_SWING_S: Final = 2.5
_TUCK_S: Final = 8.0


class SwitchCampaign:
    """Own a robot whose joints go to and fro for as long as it lives."""

    def __init__(self, folder: Path, seed: int) -> None:
        self._paths = {
            name: _written(folder, name, text)
            for name, text in {**GOOD, **{bad.name: bad.text for bad in BAD}}.items()
        }
        self._now = "swift"
        words = ("--profile", str(self._paths["swift"]), "--seed", str(seed))
        self._robot = WorkingRobot(folder / "run", *words, log=folder / "robot.log")
        self._clock = self._robot.clock
        self._targets = itertools.cycle((0.6, -0.6))
        self._swing_ns = 0
        self._meter = _Meter(self._robot)
        self._host = HostStallMonitor()
        try:
            self._tuck()
        except BaseException:
            self.close()
            raise

    def before(self) -> TickWatch:
        """Return the ticks of a while without any switch, in the same motion."""
        start = self._robot.ticks()
        self._keep_moving(_BEFORE_S)
        return self._robot.ticks().since(start)

    @property
    def next_profile(self) -> str:
        """Return the profile that is not in force."""
        return "calm" if self._now == "swift" else "swift"

    def switch(self, name: str) -> tuple[SwitchSeen, CampaignCase]:
        """Take the robot to the other profile."""
        target = self.next_profile
        rate_hz = min(control_rate_hz(self._now), control_rate_hz(target))
        seen = self._seen(target, rate_hz)
        failures = list(judge(seen, ("kept",)))
        self._now = target if seen.outcome == "kept" else self._now
        return seen, _case(name, failures, seen)

    def refuse(self, bad: Bad) -> CampaignCase:
        """Ask for a profile that must not stay."""
        in_force = self._robot.document(topics.PROFILE_STATUS).get("profile")
        seen = self._seen(bad.name, control_rate_hz(self._now), _AFTER_BAD_S)
        failures = list(judge(seen, bad.outcomes, bad.reason))
        left = self._robot.document(topics.PROFILE_STATUS).get("profile")
        if left != in_force:
            failures.append(f"profile {left} in force, expected {in_force} as before")
        return _case(bad.case, failures, seen)

    def close(self) -> None:
        """End the robot."""
        self._host.close()
        self._robot.close()

    def _tuck(self) -> None:
        """Fold the arms."""
        # Arms rest on the base without power: moving there is what a protective stop is for.
        self._robot.go(load_robot("butler").poses["tuck"])
        self._robot.pause(_TUCK_S)

    def _seen(self, target: str, least_rate_hz: float, after_s: float = 0.0) -> SwitchSeen:
        began_ns, start = self._clock.now_ns(), self._robot.ticks()
        self._host.stalls()
        self._meter.begin()
        last = self._robot.use_profile(self._paths[target], meanwhile=self._look)
        self._keep_moving(after_s)
        late, due = self._around_commit(least_rate_hz)
        return SwitchSeen(
            outcome=last["outcome"],
            reason=last["reason"],
            seconds=self._robot.since_s(began_ns),
            ticks=self._robot.ticks().since(start),
            least_rate_hz=least_rate_hz,
            moved_rad=self._meter.moved_rad,
            states=frozenset(self._meter.states),
            memory_mib=self._robot.memory_mib(),
            cause=self._meter.cause,
            late_at_commit=late,
            explained_at_commit=due,
        )

    def _around_commit(self, least_rate_hz: float) -> tuple[int | None, int]:
        """Return the late ticks in the second around the commit, and those that are explained.

        They are None where there was no commit, or control has no real-time priority.
        """
        looks = self._meter.looks
        at_ns = commit_ns(looks)
        if at_ns is None or not self._has_priority():
            return None, 0
        late, begin_ns, end_ns = late_around(looks, at_ns)
        stalls = self._host.stalls()
        return late, explained(stalls, begin_ns, end_ns, 1.0 / least_rate_hz)

    def _has_priority(self) -> bool:
        control = self._robot.pids().get("control")
        return control is not None and os.sched_getscheduler(control) == os.SCHED_FIFO

    def _keep_moving(self, duration_s: float) -> None:
        end_ns = self._clock.now_ns() + round(duration_s * NS_PER_S)
        self._robot.wait_until(lambda: self._look() or self._clock.now_ns() > end_ns, duration_s)

    def _look(self) -> bool:
        """Send the joints back from time to time and note how control is; never true."""
        self._meter.look()
        if self._clock.now_ns() >= self._swing_ns:
            self._swing_ns = self._clock.now_ns() + round(_SWING_S * NS_PER_S)
            side = next(self._targets)
            self._robot.go({"head_pan": side, "left_wrist_roll": 1.2 + 0.5 * side})
        return False


class _Meter:
    """Note control's states and how far the setpoints go."""

    def __init__(self, robot: WorkingRobot) -> None:
        self._robot = robot
        self.begin()

    def begin(self) -> None:
        """Forget what was seen."""
        self.states: set[str] = set()
        self.cause = ""
        self.moved_rad = 0.0
        self.looks: list[CommitLook] = []
        self._before: np.ndarray[Any, np.dtype[np.float64]] | None = None

    def look(self) -> None:
        """Look once."""
        phase = str(self._robot.document(topics.PROFILE_STATUS).get("phase", ""))
        late = self._robot.ticks().late
        self.looks.append(CommitLook(now_ns=self._robot.clock.now_ns(), late=late, phase=phase))
        state = self._robot.state()
        self.states.add(state)
        if state != "armed":
            status = self._robot.document(topics.CONTROL_STATUS)
            self.cause = " ".join(str(status.get(key, "")) for key in ("cause", "subject"))
        place = np.array(self._robot.setpoint())
        if self._before is not None and len(place) == len(self._before):
            self.moved_rad += float(np.abs(place - self._before).max(initial=0.0))
        self._before = place


def run(options: argparse.Namespace, tell: Callable[[str], None]) -> CampaignReport:
    """Switch `options.count` times, 100 unless told otherwise, then ask for every bad profile."""
    count = SWITCHES if options.count is None else options.count
    chosen(
        [*(f"{n:03d}/{name}" for n in range(count) for name in GOOD), *(bad.case for bad in BAD)],
        options.only,
        str,
    )  # a mistake is told before anything starts
    history: list[SwitchSeen] = []
    cases: list[CampaignCase] = []
    before = TickWatch(ticks=0, late=0)
    with tempfile.TemporaryDirectory(prefix="vla-switch-") as folder:
        try:
            campaign = SwitchCampaign(Path(folder), options.seed)
        except RobotFailed as error:
            return CampaignReport(
                campaign="switches", cases=(CampaignCase(name="start", failures=(str(error),)),)
            )
        try:
            before = campaign.before()
            for number in range(count):
                name = f"{number:03d}/{campaign.next_profile}"
                if options.only in name:
                    seen, case = campaign.switch(name)
                    history.append(seen)
                    cases.append(told(case, tell))
            cases += [told(campaign.refuse(bad), tell) for bad in BAD if options.only in bad.case]
        except RobotFailed as error:
            cases.append(told(CampaignCase(name="robot", failures=(str(error),)), tell))
        finally:
            campaign.close()
    if history:
        cases += [told(ticks_case(before, history), tell), told(memory_case(history), tell)]
    return CampaignReport(campaign="switches", cases=tuple(cases), summary=_summary(cases, history))


def _summary(cases: Sequence[CampaignCase], history: Sequence[SwitchSeen]) -> dict[str, Any]:
    sums = [case for case in cases if case.name in ("deadlines", "memory")]
    figures = {key: value for case in sums for key, value in case.figures.items()}
    kept = sum(seen.outcome == "kept" for seen in history)
    longest_s = max((seen.seconds for seen in history), default=0.0)
    return {"switches": len(history), "kept": kept, "longest_switch_s": longest_s, **figures}


def _case(name: str, failures: Sequence[str], seen: SwitchSeen) -> CampaignCase:
    figures = {
        "outcome": seen.outcome,
        "ticks": seen.ticks.ticks,
        "late": seen.ticks.late,
        "late_at_commit": seen.late_at_commit,
        "explained_at_commit": seen.explained_at_commit,
        "moved_rad": seen.moved_rad,
        "reason": seen.reason,
        "cause": seen.cause,
    }
    return CampaignCase(name=name, failures=tuple(failures), figures=figures, seconds=seen.seconds)


def _written(folder: Path, name: str, text: str) -> Path:
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return path
