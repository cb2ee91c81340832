"""Declare what may befall the servo bus as a whole, and each servo on it."""

from collections.abc import Callable
from typing import Final

from sim_twin.faults.effect import Effect, Ending, FaultParameter, Target
from sim_twin.faults.line_effects import DELAY, Rows, line_rows
from sim_twin.faults.line_tamper import LineTamper
from sim_twin.faults.plug import Plug
from sim_twin.faults.vocabulary import Component, Fault

_COOL_C: Final = 40.0


def _bus_line(target: Target) -> LineTamper:
    return target.twin.lines[target.twin.robot.servo_bus.device]


def _bus_plug(target: Target) -> Plug:
    return target.twin.plugs[target.twin.robot.servo_bus.device]


def _switched(summary: str, switch: Callable[[Target, bool], None]) -> Effect:
    """Return a fault that is a matter of on and off."""

    def begin(target: Target) -> Ending:
        switch(target, True)
        return lambda: switch(target, False)

    return Effect(summary=summary, begin=begin)


def _silence(target: Target, on: bool) -> None:
    target.twin.servos.silence(target.number, silent=on)


def _stick(target: Target, on: bool) -> None:
    target.twin.servos.stick(target.number, on)


def _garble(target: Target, on: bool) -> None:
    target.twin.servos.garble(target.number, on, seed=target.seed)


def _clash(target: Target, on: bool) -> None:
    target.twin.servos.set_clash(target.number, on, seed=target.seed)


def _mistune(target: Target, on: bool) -> None:
    target.twin.servos.set_wrong_baud(target.number, on)


def _mistune_all(target: Target, on: bool) -> None:
    for servo in target.twin.robot.servo_bus.all_servos:
        target.twin.servos.set_wrong_baud(servo.id, on)


def _echo(target: Target, on: bool) -> None:
    target.twin.servos.set_echo(on)


def _overload(target: Target, on: bool) -> None:
    target.twin.servos.overload(target.number, on)


def _overheat(target: Target) -> Ending:
    bank, servo_id = target.twin.servos, target.number
    bank.heat(servo_id, target.values["temperature_c"])
    return lambda: bank.heat(servo_id, _COOL_C)


def _delay(target: Target) -> Ending:
    bank, servo_id = target.twin.servos, target.number
    bank.delay(servo_id, target.values["delay_s"])
    return lambda: bank.delay(servo_id, 0.0)


def _slip(target: Target) -> Ending:
    twin, offset_rad = target.twin, target.values["offset_rad"]
    twin.slip_encoder(target.number, offset_rad)
    return lambda: twin.slip_encoder(target.number, -offset_rad)


def _brown_out(target: Target) -> Ending:
    twin, values = target.twin, target.values
    supplies = list(twin.servo_supplies.values())
    if number := round(values["supply"]):
        supplies = supplies[number - 1 : number]
    for supply in supplies:
        supply.ramp_to(values["volts_v"], twin.now_ns, values["ramp_s"])

    def end() -> None:
        for supply in supplies:
            supply.ramp_to(supply.usual_v, twin.now_ns, values["ramp_s"])

    return end


_VOLTS: Final = FaultParameter(
    name="volts_v", default=4.0, low=0.0, high=30.0, meaning="voltage it drops to"
)
_RAMP: Final = FaultParameter(
    name="ramp_s", default=0.05, low=0.0, high=60.0, meaning="how long it takes, each way"
)
_SUPPLY: Final = FaultParameter(
    name="supply", default=0, low=0, high=8, meaning="its place in the robot file, from 1; 0: all"
)
_OFFSET: Final = FaultParameter(
    name="offset_rad", default=1.0, low=-3.0, high=3.0, meaning="jump of the measured shaft angle"
)
_HEAT: Final = FaultParameter(
    name="temperature_c", default=95.0, low=-20.0, high=150.0, meaning="what it is heated to"
)

SERVO_ROWS: Final[Rows] = {
    **line_rows(Component.SERVO_BUS, _bus_line, _bus_plug),
    (Component.SERVO_BUS, Fault.BROWN_OUT): Effect(
        summary="the supply sags", begin=_brown_out, parameters=(_VOLTS, _RAMP, _SUPPLY)
    ),
    (Component.SERVO_BUS, Fault.WRONG_BAUD): _switched(
        "every servo at another rate than the host", _mistune_all
    ),
    (Component.SERVO_BUS, Fault.ECHO): _switched("the adapter hears its own bytes", _echo),
    (Component.SERVO, Fault.OFF): _switched("silent and deaf; its motor goes on", _silence),
    (Component.SERVO, Fault.STUCK): _switched("shows for ever what it sensed last", _stick),
    (Component.SERVO, Fault.GARBAGE): _switched("a byte of every answer is damaged", _garble),
    (Component.SERVO, Fault.WRONG): Effect(
        summary="its encoder jumps", begin=_slip, parameters=(_OFFSET,)
    ),
    (Component.SERVO, Fault.DELAYED): Effect(
        summary="its answers come late", begin=_delay, parameters=(DELAY,)
    ),
    (Component.SERVO, Fault.OVERHEAT): Effect(
        summary="hot until cleared; then only a reboot ends its alert",
        begin=_overheat,
        parameters=(_HEAT,),
    ),
    (Component.SERVO, Fault.OVERLOAD): _switched(
        "overloaded until cleared; then only a reboot ends its alert", _overload
    ),
    (Component.SERVO, Fault.ID_CLASH): _switched("two servos answer to its id", _clash),
    (Component.SERVO, Fault.WRONG_BAUD): _switched("at another rate than the host", _mistune),
}
