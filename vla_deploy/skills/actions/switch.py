"""Switch devices of the home: nothing is believed of them that was not read back."""

from collections.abc import Mapping
from typing import Any, Final

from vla_deploy.devices import DeviceNotUsable, DeviceReading, DeviceTask, SwitchedDevice
from vla_deploy.plans.knowledge import match_device, spoken_devices
from vla_deploy.skills.context import Skill, SkillContext
from vla_deploy.skills.errors import NotPossible, SkillFailed, TryAgain
from vla_deploy.skills.movements.motion import pause, wait_until

PATIENCE_S: Final = 12.0
"""A device that does not answer is given up by its own time limits before."""
SETTLE_S: Final = 0.5
"""Who switches back does so at once: an overload, a timer, another one's automation."""
_WORDS: Final = {True: "on", False: "off"}


def turn_on(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Switch a device on, and read back that it is.

    Raises:
        TryAgain: it or its broker does not answer, or it does not stay on.
        NotPossible: there is no such device, or a person has to mend its set-up.
    """
    yield from _switch(_device(context, parameters), context, on=True)


def turn_off(context: SkillContext, parameters: Mapping[str, Any]) -> Skill:
    """Switch a device off, and read back that it is.

    Raises:
        TryAgain: it or its broker does not answer, or it does not stay off.
        NotPossible: there is no such device, or a person has to mend its set-up.
    """
    yield from _switch(_device(context, parameters), context, on=False)


def _device(context: SkillContext, parameters: Mapping[str, Any]) -> SwitchedDevice:
    known = spoken_devices(context.robot)
    name = match_device(parameters["device"], known)
    device = None if name is None or context.devices is None else context.devices.named(name)
    if device is None:
        listed = ", ".join(sorted(set(known.values()))) or "none"
        raise NotPossible(f'no device "{parameters["device"]}" to switch; known: {listed}')
    return device


def _switch(device: SwitchedDevice, context: SkillContext, *, on: bool) -> Skill:
    told: list[DeviceReading] = []
    yield from _told(device, device.switch(on), context, told)
    _expect(device, told[-1], on, f"after it was switched {_WORDS[on]}")
    yield from pause(context, SETTLE_S)
    yield from _told(device, device.look(), context, told)
    _expect(device, told[-1], on, f"{SETTLE_S:g} s after it had told that it was {_WORDS[on]}")
    notes = [one.note for one in told if one.note]
    context.note("; ".join([f"{device.device.spoken} is {_WORDS[on]}, as read back", *notes]))


def _told(
    device: SwitchedDevice, task: DeviceTask, context: SkillContext, told: list[DeviceReading]
) -> Skill:
    """Wait for what a device tells, and add it to what was `told`."""
    try:
        yield from wait_until(context, lambda: task.done, PATIENCE_S)
    finally:
        device.withdraw(task)
    if task.reading is None:
        raise _failure(device, task)
    told.append(task.reading)


def _failure(device: SwitchedDevice, task: DeviceTask) -> SkillFailed:
    name = device.device.spoken
    if isinstance(task.fault, DeviceNotUsable):
        return NotPossible(f"{name}: {task.fault}")
    return TryAgain(f"{name}: {task.fault or f'no answer of {device.where} in {PATIENCE_S:g} s'}")


def _expect(device: SwitchedDevice, reading: DeviceReading, on: bool, when: str) -> None:
    if reading.is_on is not on:
        told = _WORDS[reading.is_on]
        raise TryAgain(f"{device.device.spoken}: {device.where} tells that it is {told} {when}")
