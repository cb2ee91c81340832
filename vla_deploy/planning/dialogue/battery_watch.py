"""Do what the battery rules decide: say it, end what goes on, go to charge as by any command."""

import itertools
import logging
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.ipc.announcer import Announcer
from vla_deploy.planning.dialogue.command_manager import CommandManager
from vla_deploy.planning.dialogue.situation import Situation
from vla_deploy.plans.battery_rules import BatteryAct, RobotNow, RuleState, acts_on, is_let_at_low
from vla_deploy.plans.errors import PlanError
from vla_deploy.plans.plan import Action, Plan
from vla_deploy.robots.battery_settings import BatterySettings

SOURCE: Final = "battery"
LOOK_NS: Final = NS_PER_S
_log = logging.getLogger(__name__)


class BatteryWatch:
    """Look at the battery once a second."""

    def __init__(
        self,
        settings: BatterySettings,
        situation: Situation,
        manager: CommandManager,
        space: SharedSpace,
        clock: Clock,
    ) -> None:
        self._settings = settings
        self._situation = situation
        self._manager = manager
        self._utterances = space.ring_writer(topics.UTTERANCE)
        self._voice = Announcer(space, SOURCE, clock)
        self._clock = clock
        self._state = RuleState()
        self._numbers = itertools.count(1)
        self._due_ns = clock.now_ns()

    def step(self) -> None:
        """Act on the battery where that is due."""
        now_ns = self._clock.now_ns()
        if now_ns < self._due_ns:
            return
        self._due_ns = now_ns + LOOK_NS
        battery = self._situation.battery()
        self._state, acts = acts_on(self._state, battery, self._settings, self._robot_now(), now_ns)
        for act in acts:
            self._do(act)

    def _do(self, act: BatteryAct) -> None:
        _log.warning("battery: %s", act.name.lower().replace("_", " "))
        if act.value:
            self._voice.say(act.value)
        if act is BatteryAct.END_PLANS:
            self._manager.stop_all(self._new_id())
        elif act is BatteryAct.CHARGE:
            plan = Plan(goal="charge the battery", actions=(Action(id="a1", skill="charge"),))
            self._utterances.publish(
                {
                    "command_id": self._new_id(),
                    "source": SOURCE,
                    "plan": plan.model_dump(mode="json"),
                }
            )

    def _robot_now(self) -> RobotNow:
        manager, station = self._manager, self._settings.station
        plans = manager.plans_carried_out
        charges = bool(plans) and all(
            is_let_at_low(one, station) for plan in plans for one in plan.actions
        )
        return RobotNow(
            may_move=self._may_move(),
            is_idle=not manager.is_at_work,
            goes_on=manager.is_at_work and not charges,
        )

    def _may_move(self) -> bool:
        try:
            self._situation.check_ready()
        except PlanError:  # an emergency stop, disarmed, a fault: it waits
            return False
        return True

    def _new_id(self) -> str:
        return f"{SOURCE}-{self._clock.now_ns() // NS_PER_S}-{next(self._numbers)}"
