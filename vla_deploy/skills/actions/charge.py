"""Go to the charging station, and see that the battery charges."""

from collections.abc import Mapping
from typing import Any, Final

from vla_deploy.client.battery import SILENT, battery_words
from vla_deploy.robots.battery_settings import BatterySource
from vla_deploy.skills.actions.navigate import navigate_to
from vla_deploy.skills.context import Skill, SkillContext, spoken
from vla_deploy.skills.errors import NotPossible, TryAgain
from vla_deploy.skills.movements.motion import wait_until

CHARGES_WITHIN_S: Final = 10.0
"""A charger looks at the pack before it gives current."""
FULL_RATIO: Final = 0.99


def charge(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Drive to the station and stand there until the battery tells that it charges, or is full.

    Raises:
        NotPossible: no place is known where the robot charges, or no path leads there.
        TryAgain: the robot stands there, and the battery does not charge.
    """
    settings = context.robot.battery
    station = parameters.get("place") or ("" if settings is None else settings.station)
    if not station:
        raise NotPossible("I know no place where I can charge: [battery] station names it")
    yield from navigate_to(context, {"place": station})
    if settings is None or settings.source is BatterySource.SERVOS:
        context.note("nothing here tells whether the battery charges")
        return
    yield from wait_until(context, lambda: _charges(context), CHARGES_WITHIN_S)
    if not _charges(context):
        battery = context.link.battery
        told = SILENT if battery is None else battery_words(battery)
        raise TryAgain(f"I stand at the {spoken(station)}, but the battery does not charge: {told}")


def _charges(context: SkillContext) -> bool:
    battery = context.link.battery
    if battery is None:
        return False
    return bool(battery["is_charging"]) or (battery["charge_ratio"] or 0.0) >= FULL_RATIO
