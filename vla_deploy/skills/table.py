"""Tie each skill of the catalogue to the code that does it."""

from types import MappingProxyType

from vla_deploy.skills.actions.charge import charge
from vla_deploy.skills.actions.find import find_object
from vla_deploy.skills.actions.follow import follow_person
from vla_deploy.skills.actions.guard import guard
from vla_deploy.skills.actions.hand_over import hand_over
from vla_deploy.skills.actions.inspect import inspect
from vla_deploy.skills.actions.navigate import navigate_to
from vla_deploy.skills.actions.pick import pick_up
from vla_deploy.skills.actions.place import place
from vla_deploy.skills.actions.simple import speak, stop, wait
from vla_deploy.skills.actions.sweep import sweep
from vla_deploy.skills.actions.switch import turn_off, turn_on
from vla_deploy.skills.context import SkillFunction
from vla_deploy.skills.movements.arms import close_gripper, move_arm, open_gripper
from vla_deploy.skills.movements.drive import move, turn
from vla_deploy.skills.movements.gaze import look_at

SKILL_FUNCTIONS: MappingProxyType[str, SkillFunction] = MappingProxyType(
    {
        "navigate_to": navigate_to,
        "charge": charge,
        "follow_person": follow_person,
        "guard": guard,
        "inspect": inspect,
        "sweep": sweep,
        "move": move,
        "turn": turn,
        "look_at": look_at,
        "find_object": find_object,
        "pick_up": pick_up,
        "place": place,
        "hand_over": hand_over,
        "open_gripper": open_gripper,
        "close_gripper": close_gripper,
        "move_arm": move_arm,
        "speak": speak,
        "wait": wait,
        "turn_on": turn_on,
        "turn_off": turn_off,
        "stop": stop,
    }
)
