"""Declare what may befall the battery and its gauge."""

from typing import Final

from sim_twin.battery import GaugeFault, TwinBattery
from sim_twin.errors import FaultRefused
from sim_twin.faults.effect import Effect, Ending, FaultParameter, Target
from sim_twin.faults.line_effects import Rows
from sim_twin.faults.vocabulary import Component, Fault

_CHARGE: Final = FaultParameter(
    name="charge_ratio", default=0.2, low=0.0, high=1.0, meaning="charge that is left in it"
)


def _battery(target: Target) -> TwinBattery:
    battery = target.twin.battery
    if battery is None:
        raise FaultRefused("battery: the robot file has no [battery]")
    return battery


def _gauge(summary: str, fault: GaugeFault) -> Effect:
    def begin(target: Target) -> Ending:
        battery = _battery(target)
        battery.gauge_fault = fault

        def end() -> None:
            battery.gauge_fault = GaugeFault.NONE

        return end

    return Effect(summary=summary, begin=begin)


def _drain(target: Target) -> Ending:
    _battery(target).charge_ratio = target.values["charge_ratio"]
    return lambda: None  # only charging brings it back


BATTERY_ROWS: Final[Rows] = {
    (Component.BATTERY, Fault.UNPLUG): _gauge("its gauge is gone", GaugeFault.GONE),
    (Component.BATTERY, Fault.STUCK): _gauge("its gauge shows the same", GaugeFault.STUCK),
    (Component.BATTERY, Fault.GARBAGE): _gauge("its gauge shows no numbers", GaugeFault.GARBAGE),
    (Component.BATTERY, Fault.BROWN_OUT): Effect(
        summary="it is drained to a charge", begin=_drain, parameters=(_CHARGE,)
    ),
}
