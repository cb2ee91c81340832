"""Kill, freeze and end every process of the robot at random moments of its work.

The machine is a twin that runs by itself, so physics goes on and judges whatever dies; all lives
and is judged in its time, so it does not matter how busy this computer is. The robot runs as a
service does, restarted and watched by `sim_twin.harness.service_runner` in systemd's place.
"""

import argparse
import contextlib
import math
import tempfile
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event
from typing import Any, Final

from drivers.clock import NS_PER_S
from sim_twin.campaigns.killing.moment import Work
from sim_twin.campaigns.killing.rest import RestWatch
from sim_twin.campaigns.killing.rules import RULES, Injection, KillRule, injections, rule_of
from sim_twin.campaigns.report import CampaignCase, CampaignReport, crash_is_failure, told
from sim_twin.campaigns.selection import chosen
from sim_twin.harness.service import Machine, RobotService
from vla_deploy.robots import load_robot
from vla_deploy.supervisor.table import RestartPolicy

INJECTIONS: Final = 200
_POLL_S: Final = 0.02
_SETTLE_S: Final = 1.0
_POLL_LATER_S: Final = 0.05


class KillCampaign:
    """Own a machine and a robot, and do injections one after the other."""

    def __init__(self, folder: Path, seed: int, robot: str = "butler") -> None:
        self._hit_ns: dict[str, int] = {}
        self._described = load_robot(robot)
        self._machine = Machine(folder / "machine", robot=robot, seed=seed)
        self._clock = self._machine.clock
        try:
            devices = self._machine.devices_dir
            self._robot = RobotService(folder / "run", devices, self._clock, robot)
        except BaseException:
            self._machine.close()
            raise
        self._work = Work(self._robot, self._machine)

    def inject(self, injection: Injection) -> CampaignCase:
        """Do one and judge it."""
        self._let_run_stably(injection.process)
        self._robot.make_ready()
        try:
            return self._hit(injection)
        finally:
            if rule_of(self._described, injection).rest_s is not None:
                self._work.end()  # the robot stopped, and with it what it was told to do
            self._hit_ns[injection.process] = self._clock.now_ns()

    def _hit(self, injection: Injection) -> CampaignCase:
        """Wait for the moment, send the signal, and judge what follows."""
        rule = rule_of(self._described, injection)
        met = self._work.meet(injection)
        self._machine.begin_watch()
        began_ns = self._clock.now_ns()
        pid = self._robot.send_signal(injection.process, injection.signal)
        rest = RestWatch(rule)
        ready_s = self._follow(began_ns, rest, injection.process, pid)
        self._settle(began_ns, rest)
        state = self._robot.state()
        failures = [*self._machine.hazards(), *rest.failures()]
        failures += rule.judge(ready_s, state, self._robot.why())
        failures += [f"orphan {orphan}" for orphan in self._robot.orphans()]
        figures = {"rest_s": rest.rest_s, "ready_s": ready_s, "state": state, **met}
        return CampaignCase(
            name=injection.name,
            failures=tuple(failures),
            figures={**figures, "moved_rad": rest.moved_rad},
            seconds=self._robot.since_s(began_ns),
        )

    def close(self) -> None:
        """End the robot's work, the robot, then its machine."""
        with contextlib.ExitStack() as closing:  # each, even where one of them fails
            closing.callback(self._machine.close)
            closing.callback(self._robot.close)
            closing.callback(self._work.end)

    def _let_run_stably(self, process: str) -> None:
        """Hit a process only after a stable run: six failures in a row are another matter."""
        stable_ns = round(RestartPolicy().stable_s * NS_PER_S)
        if process in self._hit_ns:
            self._clock.sleep_until(self._hit_ns[process] + stable_ns)

    def _follow(self, began_ns: int, rest: RestWatch, process: str, pid: int) -> float:
        """Watch motion until all is ready again, and return when it was."""
        rule, ready_s, since_s = rest.rule, math.inf, 0.0
        while since_s < max(rest.least_s, rule.ready_s) and (
            since_s < rest.least_s or math.isinf(ready_s)
        ):
            since_s = self._look(began_ns, rest)
            if math.isinf(ready_s) and self._is_back(rule, process, pid):
                ready_s = since_s
            self._robot.pause(_POLL_S if since_s < rest.least_s else _POLL_LATER_S)
        return ready_s

    def _settle(self, began_ns: int, rest: RestWatch) -> None:
        """Watch on for a while: what comes back must not move anything."""
        end_ns = self._clock.now_ns() + round(_SETTLE_S * NS_PER_S)
        while self._clock.now_ns() < end_ns:
            self._look(began_ns, rest)
            self._robot.pause(_POLL_LATER_S)

    def _look(self, began_ns: int, rest: RestWatch) -> float:
        since_s = self._robot.since_s(began_ns)
        if rest.wants(since_s):
            rest.look(since_s, self._machine.truth())
        return since_s

    def _is_back(self, rule: KillRule, process: str, pid: int) -> bool:
        if rule.ends:
            return self._robot.has_ended()
        return self._robot.is_ready() and self._robot.pids().get(process) not in (None, pid)


def run(options: argparse.Namespace, tell: Callable[[str], None]) -> CampaignReport:
    """Do `options.count` injections, 200 unless told otherwise."""
    count = INJECTIONS if options.count is None else options.count
    described = load_robot(options.robot)
    without = () if described.microphone or described.speaker else ("speech",)
    drawn = injections(count, options.seed, without=without)
    drawn = chosen(drawn, options.only, lambda each: each.name)
    return inject_all(drawn, options.seed, tell, options.workers, options.robot)


def inject_all(
    drawn: Sequence[Injection],
    seed: int,
    tell: Callable[[str], None],
    workers: int = 1,
    robot: str = "butler",
) -> CampaignReport:
    """Do injections on so many machines at a time, on each one after the other."""
    shares = [drawn[first::workers] for first in range(min(workers, len(drawn)))]
    is_over = Event()
    with ThreadPoolExecutor(max(1, len(shares))) as pool:
        done = pool.map(
            lambda share: _inject_on_one_machine(share, seed, robot, tell, is_over), shares
        )
        try:
            cases = [case for share in done for case in share]
        finally:
            is_over.set()  # who asks for an end waits for the injections that are under way
    return CampaignReport(campaign="kills", cases=tuple(cases), summary=_summary(cases))


def _inject_on_one_machine(
    drawn: Sequence[Injection],
    seed: int,
    robot: str,
    tell: Callable[[str], None],
    is_over: Event,
) -> list[CampaignCase]:
    with (
        tempfile.TemporaryDirectory(prefix="vla-kill-") as folder,
        contextlib.closing(KillCampaign(Path(folder), seed, robot)) as campaign,
    ):
        return [
            told(_injected(injection, campaign), tell)
            for injection in drawn
            if not is_over.is_set()
        ]


@crash_is_failure  # for the next one the robot is made ready anew
def _injected(injection: Injection, campaign: KillCampaign) -> CampaignCase:
    return campaign.inject(injection)


def _share(met: Sequence[Mapping[str, Any]], is_so: Callable[[Mapping[str, Any]], object]) -> float:
    return sum(bool(is_so(each)) for each in met) / max(len(met), 1)


def _summary(cases: Sequence[CampaignCase]) -> dict[str, Any]:
    """Return what was hit in motion, and each process' longest way to rest and back to ready."""
    met = [case.figures for case in cases if "motion" in case.figures]
    summary: dict[str, Any] = {
        "unsafe": sum(bool(case.failures) for case in cases),
        "hit_in_motion_ratio": _share(met, lambda each: each["motion"]),
        "hit_while_carrying_ratio": _share(met, lambda each: each["held"]),
        "hit_while_picking_ratio": _share(met, lambda each: each["skill"] == "pick_up"),
        "hit_while_placing_ratio": _share(met, lambda each: each["skill"] == "place"),
        "hit_while_driving_ratio": _share(met, lambda each: "wheel" in each["motion"]),
    }
    for process in sorted({process for process, _ in RULES}):
        mine = [case.figures for case in cases if case.figures and f"/{process}/" in case.name]
        rests = [each["rest_s"] for each in mine if not math.isnan(each["rest_s"])]
        summary[f"{process}_longest_rest_s"] = max(rests, default=math.nan)
        summary[f"{process}_longest_ready_s"] = max((each["ready_s"] for each in mine), default=0.0)
    return summary
