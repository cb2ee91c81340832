"""A relay on a GPIO line, at libgpiod: opening switches nothing, and the line is read back."""

import errno
import os
from typing import Any

import gpiod
import pytest

from vla_deploy.devices import DeviceAway
from vla_deploy.devices.gpio_link import GpioLink
from vla_deploy.robots.home_devices import GpioLine

LOW, HIGH = False, True


class Chip:
    """Stand in for a chip where libgpiod's Python calls it; `level` is that of the wire."""

    def __init__(self) -> None:
        self.level = LOW
        self.is_stuck = False
        self.fault: OSError | None = None
        self.is_output = False
        self.active_low = False

    def request_lines(self, path: str, *, consumer: str, config: dict[int, Any]) -> "Chip":
        assert consumer
        assert path == "/dev/gpiochip0"
        self._raise()
        (settings,) = config.values()
        assert settings.direction == gpiod.line.Direction.AS_IS
        self.active_low = settings.active_low
        return self

    def reconfigure_lines(self, config: dict[int, Any]) -> None:
        (settings,) = config.values()
        assert settings.direction == gpiod.line.Direction.OUTPUT
        self.is_output = True
        self.active_low = settings.active_low
        self.set_value(next(iter(config)), settings.output_value)

    def get_value(self, offset: int) -> Any:
        assert offset == 17
        self._raise()
        is_active = self.level is not self.active_low
        return gpiod.line.Value.ACTIVE if is_active else gpiod.line.Value.INACTIVE

    def set_value(self, offset: int, value: Any) -> None:
        assert offset == 17
        assert self.is_output
        self._raise()
        if not self.is_stuck:
            self.level = (value == gpiod.line.Value.ACTIVE) is not self.active_low

    def release(self) -> None:
        self.is_output = False

    def _raise(self) -> None:
        if self.fault is not None:
            raise self.fault


@pytest.fixture
def chip(monkeypatch: pytest.MonkeyPatch) -> Chip:
    chip = Chip()
    monkeypatch.setattr("gpiod.request_lines", chip.request_lines)
    return chip


@pytest.mark.parametrize("active_low", [False, True])
@pytest.mark.parametrize("level", [LOW, HIGH])
def test_opening_switches_nothing_and_commands_do(
    chip: Chip, active_low: bool, level: bool
) -> None:
    chip.level = level
    link = GpioLink(GpioLine(chip="/dev/gpiochip0", line=17, active_low=active_low))
    assert link.read().is_on is (level is not active_low)
    assert chip.level is level
    for on in (True, False, True):
        assert link.switch(on).is_on is on
        assert chip.level is (on is not active_low)
    link.close()


def test_a_line_that_stays_is_told_as_it_is(chip: Chip) -> None:
    chip.is_stuck = True
    assert not GpioLink(GpioLine(chip="/dev/gpiochip0", line=17)).switch(True).is_on


@pytest.mark.parametrize(
    ("number", "why"),
    [(errno.ENOENT, "gpiodetect"), (errno.EBUSY, "gpioinfo"), (errno.EACCES, "group gpio")],
)
def test_a_line_that_is_not_to_be_had_is_named_and_had_later(
    chip: Chip, number: int, why: str
) -> None:
    link = GpioLink(GpioLine(chip="/dev/gpiochip0", line=17))
    chip.fault = OSError(number, os.strerror(number))
    if number == errno.EACCES:
        chip.fault = PermissionError(number, os.strerror(number))
    with pytest.raises(DeviceAway, match=f"/dev/gpiochip0 line 17: .*{why}"):
        link.read()
    chip.fault = None
    assert link.switch(True).is_on
    chip.fault = OSError(errno.ENODEV, os.strerror(errno.ENODEV))
    with pytest.raises(DeviceAway, match="plug the GPIO adapter in again"):
        link.switch(False)
