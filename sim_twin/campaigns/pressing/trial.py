"""Lead one working robot through one trouble: before it, under it, and back to full service."""

import math
from collections.abc import Callable
from typing import Any, Final

from drivers.clock import NS_PER_S
from sim_twin.campaigns.pressing.judge import TroubleSeen, steps_of
from sim_twin.campaigns.pressing.pressed_scene import PressedScene
from sim_twin.campaigns.pressing.troubles import Trouble
from sim_twin.harness.robot import RobotFailed

_SETTLED_S: Final = 5.0
_SETTLE_LIMIT_S: Final = 60.0
_BEFORE_S: Final = 15.0
_HOLD_S: Final = 5.0
_NEXT_JOB_S: Final = 1.0
_JOBS: Final = (
    "look left",
    "pick up the red cup and put it in the box",
    "look right",
    "go to the kitchen",
    "go to the charging station",
)
_PROOF: Final = "look left"


class PressureTrial:
    """Lead one robot through one trouble."""

    def __init__(self, trouble: Trouble, scene: PressedScene) -> None:
        self._trouble = trouble
        self._scene = scene
        self._clock = scene.robot.clock
        self._since = scene.robot.since_s
        self._jobs = 0
        self._next_job_ns = 0
        self._states: dict[str, str] = {}
        self._over: set[str] = set()
        self._history_before = 0

    def run(self) -> TroubleSeen:
        """Work, press, lift, and wait for full service."""
        self._settle()
        scene, robot = self._scene, self._scene.robot
        start = robot.ticks()
        self._work(lambda: False, _BEFORE_S)
        before, at_work = robot.ticks().since(start), robot.ticks()
        pids, began_ns = robot.pids(), self._clock.now_ns()
        self._states.clear()
        robot.begin_watch()
        self._trouble.press(scene, 0.0)
        self._work_pressed(began_ns, self._has_answered, self._trouble.steps_s)
        steps_s = self._since(began_ns) if self._has_answered() else math.nan
        self._work_pressed(began_ns, lambda: False, _HOLD_S)
        during, pressed = robot.ticks().since(at_work), robot.ticks()
        self._trouble.lift(scene)
        service_s = self._time_to_service()
        history = self._history()
        later = robot.pids()
        return TroubleSeen(
            taken=steps_of(history, taken=True),
            undone=steps_of(history, taken=False),
            metrics_over=frozenset(self._over),
            before=before,
            during=during,
            after=robot.ticks().since(pressed),
            states=self._states,
            replaced=frozenset(name for name in pids if later.get(name) != pids[name]),
            crashed=tuple(scene.crashes()),
            hazards=robot.hazards(),
            steps_s=steps_s,
            service_s=service_s,
        )

    def _settle(self) -> None:
        """Wait until nothing of the start is left in the budgets."""
        calm_ns = self._clock.now_ns()

        def settled() -> bool:
            nonlocal calm_ns
            if not self._is_calm():
                calm_ns = self._clock.now_ns()
            return self._since(calm_ns) > _SETTLED_S

        if not self._scene.robot.wait_until(settled, _SETTLE_LIMIT_S):
            raise RobotFailed(f"budgets are not kept without any trouble: {self._scene.budget()}")
        self._history_before = len(self._scene.budget()["ladder"]["history"])

    def _work_pressed(self, began_ns: int, until: Callable[[], bool], limit_s: float) -> None:
        def pressed() -> bool:
            self._trouble.press(self._scene, self._since(began_ns))
            return until()

        self._work(pressed, limit_s)

    def _has_answered(self) -> bool:
        """Return whether every expected step was taken and every expected line was over."""
        taken = steps_of(self._history(), taken=True)
        trouble = self._trouble
        return len(taken) >= len(trouble.steps) and (
            not trouble.metric or trouble.metric in self._over
        )

    def _time_to_service(self) -> float:
        """Return when the robot had done a job again with every process and no step in force."""
        began_ns, talk = self._clock.now_ns(), self._scene.talk
        limit_s = self._trouble.service_s
        if not self._work(lambda: self._is_calm() and self._scene.robot.is_ready(), limit_s):
            return math.nan
        talk.cancel()
        done = talk.done

        def has_proved() -> bool:
            if not talk.is_busy and talk.done == done:
                talk.say(_PROOF)
            return talk.done > done

        proved = self._look(has_proved, max(limit_s - self._since(began_ns), 0.0))
        return self._since(began_ns) if proved else math.nan

    def _work(self, until: Callable[[], bool], limit_s: float) -> bool:
        """Give job after job, and look."""

        def work() -> bool:
            if self._scene.talk.is_busy:
                self._next_job_ns = self._clock.now_ns() + round(_NEXT_JOB_S * NS_PER_S)
            elif self._clock.now_ns() >= self._next_job_ns:
                self._scene.talk.say(_JOBS[self._jobs % len(_JOBS)])
                self._jobs += 1
            return until()

        return self._look(work, limit_s)

    def _look(self, until: Callable[[], bool], limit_s: float) -> bool:
        def look() -> bool:
            self._scene.talk.listen()
            self._states.setdefault(*self._scene.robot.state_and_why())
            rows = self._scene.budget().get("rows", ())
            self._over |= {row["metric"] for row in rows if row["over"]}
            return until()

        return self._scene.robot.wait_until(look, limit_s)

    def _is_calm(self) -> bool:
        budget = self._scene.budget()
        if not budget:
            return False
        over = any(row["over"] or row["state"] == "rising" for row in budget["rows"])
        return not over and budget["ladder"]["step"] == 0 and not budget["stop"]

    def _history(self) -> list[dict[str, Any]]:
        budget = self._scene.budget()
        history: list[dict[str, Any]] = budget["ladder"]["history"] if budget else []
        return history[self._history_before :]
