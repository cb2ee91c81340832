"""Keep a robot at work until the moment at which a signal is to hit it."""

import itertools
import subprocess
from collections.abc import Iterator, Mapping
from typing import Any, Final

from drivers.clock import NS_PER_S
from sim_twin.campaigns.killing.jobs import jobs_of
from sim_twin.campaigns.killing.rules import Injection, KillMoment
from sim_twin.harness.service import Machine, RobotService
from vla_deploy.robots import load_robot

MOVING_RAD_S: Final = 0.1
"""The base or an arm that is slower is about to start or to end a motion."""
_POLL_S: Final = 0.02
_LONGEST_S: Final = 120.0
"""A command that waits longer than this waits for what the kill took with it."""
_WITHIN_S: Final[Mapping[KillMoment, float]] = {KillMoment.MOVING: 10.0, KillMoment.CARRYING: 60.0}


class Work:
    """Give one command after the other, and say what the robot is at.

    A command that outlives a kill goes on, so that the next one may hit its later part.
    """

    def __init__(self, robot: RobotService, machine: Machine) -> None:
        self._robot = robot
        self._machine = machine
        self._clock = robot.clock
        self._job: subprocess.Popen[str] | None = None
        self._job_ns = 0
        self._has_put_down = False
        described = load_robot(machine.robot)
        self._jobs = jobs_of(described)
        self._put_down = itertools.cycle(self._jobs.put_down)
        arms = [described.group(hand.arm).joints for hand in described.hands.values()]
        self._parts = (*itertools.chain.from_iterable(arms), *described.wheel_joints)

    def meet(self, injection: Injection) -> dict[str, Any]:
        """Work until the injection's time and moment, and return what the robot is at then.

        A moment that does not come within its time is missed: the figures say so.
        """
        every = self._jobs.commands
        first = injection.number % len(every)
        commands = itertools.cycle((*every[first:], *every[:first]))
        due_ns = self._clock.now_ns() + round(injection.after_s * NS_PER_S)
        end_ns = due_ns + round(_WITHIN_S[injection.moment] * NS_PER_S)
        while True:
            self._keep_at_it(commands)
            met = self._met()
            is_carrying = bool(met["held"]) or injection.moment is not KillMoment.CARRYING
            now_ns = self._clock.now_ns()
            if now_ns >= end_ns or (now_ns >= due_ns and met["motion"] and is_carrying):
                return met
            self._robot.pause(_POLL_S)

    def end(self) -> None:
        """End the command that goes on."""
        if self._job is not None:
            self._robot.interrupt(self._job)
            self._job = None

    def _keep_at_it(self, commands: Iterator[str]) -> None:
        """Give the next command once the last has ended, or has waited too long."""
        now_ns = self._clock.now_ns()
        if now_ns - self._job_ns > _LONGEST_S * NS_PER_S:
            self.end()
        if self._job is None or self._job.poll() is not None:
            quiet = subprocess.DEVNULL
            self._job = self._robot.begin("say", self._next(commands), output=quiet)
            self._job_ns = now_ns

    def _next(self, commands: Iterator[str]) -> str:
        """Return what to say next; every other time, that a full hand puts down what it has."""
        held = self._machine.truth()["held"]
        self._has_put_down = bool(held) and not self._has_put_down
        if self._has_put_down:
            return next(self._put_down)
        return next(commands)

    def _met(self) -> dict[str, Any]:
        truth = self._machine.truth()
        speeds = {part: abs(float(truth["joints"][part]["velocity"])) for part in self._parts}
        part, speed_rad_s = max(speeds.items(), key=lambda item: item[1])
        return {
            "motion": part if speed_rad_s > MOVING_RAD_S else "",
            "held": truth["held"],
            "skill": self._robot.skill(),
        }
