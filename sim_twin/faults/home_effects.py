"""Declare what may befall the home: its broker, and the lamps and sockets on it."""

from typing import Final

from sim_twin.errors import FaultRefused, TwinModelMismatch
from sim_twin.faults.effect import Effect, Ending, Target
from sim_twin.faults.vocabulary import Component, Fault
from sim_twin.home.appliances import ApplianceFault, EmulatedHome


def _home(target: Target) -> EmulatedHome:
    try:
        return target.twin.home
    except TwinModelMismatch as error:
        raise FaultRefused(str(error)) from error


def _switch_broker_off(target: Target) -> Ending:
    broker = _home(target).broker
    broker.go_off()
    return broker.come_back


def _befall(target: Target, fault: ApplianceFault) -> Ending:
    """Let the appliance fail whose place in the robot file, from 1, is the target's number."""
    name = list(target.twin.robot.devices)[target.number - 1]
    appliance = _home(target).appliances.get(name)
    if appliance is None:
        raise FaultRefused(f"{name}: the twin's home has devices on MQTT alone")
    appliance.fault = fault

    def end() -> None:
        appliance.fault = ApplianceFault.NONE

    return end


HOME_ROWS: Final = {
    (Component.BROKER, Fault.OFF): Effect(
        summary="it ends every connection and takes none", begin=_switch_broker_off
    ),
    (Component.HOME_DEVICE, Fault.OFF): Effect(
        summary="it follows no command and says nothing",
        begin=lambda target: _befall(target, ApplianceFault.SILENT),
    ),
    (Component.HOME_DEVICE, Fault.STUCK): Effect(
        summary="it answers, and stays as it is",
        begin=lambda target: _befall(target, ApplianceFault.STUCK),
    ),
    (Component.HOME_DEVICE, Fault.WRONG): Effect(
        summary="it switches, and back at once",
        begin=lambda target: _befall(target, ApplianceFault.FLIPS_BACK),
    ),
}
