"""Declare what may befall the servo bus as a whole, and each servo on it."""

from typing import Final

from drivers.dynamixel.control_table import HardwareError
from sim_twin.faults.effect import Effect, Ending, Parameter, Target
from sim_twin.faults.line_effects import Rows, line_rows
from sim_twin.faults.line_tamper import LineTamper
from sim_twin.faults.plug import Plug
from sim_twin.faults.supply import NOMINAL_V
from sim_twin.faults.vocabulary import Component, Fault


def _bus_line(target: Target) -> LineTamper:
    return target.twin.lines[target.twin.robot.servo_bus.device]


def _bus_plug(target: Target) -> Plug:
    return target.twin.plugs[target.twin.robot.servo_bus.device]


def _brown_out(target: Target) -> Ending:
    twin, values = target.twin, target.values
    twin.servo_supply.ramp_to(values["volts_v"], twin.now_ns, values["ramp_s"])
    return lambda: twin.servo_supply.ramp_to(NOMINAL_V, twin.now_ns, values["ramp_s"])


def _off(target: Target) -> Ending:
    bank, servo_id = target.twin.servos, target.number
    bank.silence(servo_id)
    return lambda: bank.silence(servo_id, silent=False)


def _wrong(target: Target) -> Ending:
    twin, offset_rad = target.twin, target.values["offset_rad"]
    twin.slip_encoder(target.number, offset_rad)
    return lambda: twin.slip_encoder(target.number, -offset_rad)


def _alert(bits: HardwareError) -> Effect:
    """Return a fault that the servo reports itself; only a reboot ends it, so clearing does not."""

    def begin(target: Target) -> Ending:
        target.twin.servos.set_alert(target.number, bits)
        return lambda: None

    words = (bits.name or "").lower()
    return Effect(summary=f"reports {words}; only a reboot clears it", begin=begin)


_VOLTS: Final = Parameter(
    name="volts_v", default=4.0, low=0.0, high=30.0, meaning="voltage it drops to"
)
_RAMP: Final = Parameter(
    name="ramp_s", default=0.05, low=0.0, high=60.0, meaning="how long it takes, each way"
)
_SLIP: Final = Parameter(
    name="offset_rad", default=1.0, low=-3.0, high=3.0, meaning="jump of the measured shaft angle"
)

SERVO_ROWS: Final[Rows] = {
    **line_rows(Component.SERVO_BUS, _bus_line, _bus_plug),
    (Component.SERVO_BUS, Fault.BROWN_OUT): Effect(
        summary="the supply sags", begin=_brown_out, parameters=(_VOLTS, _RAMP)
    ),
    (Component.SERVO, Fault.OFF): Effect(summary="silent and deaf; its motor goes on", begin=_off),
    (Component.SERVO, Fault.WRONG): Effect(
        summary="its encoder jumps", begin=_wrong, parameters=(_SLIP,)
    ),
    (Component.SERVO, Fault.OVERHEAT): _alert(HardwareError.OVERHEATING),
    (Component.SERVO, Fault.OVERLOAD): _alert(HardwareError.OVERLOAD),
}
