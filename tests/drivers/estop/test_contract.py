"""Both e-stop drivers keep the contract: HID on a wire and behind a socket, GPIO at libgpiod."""

import errno
import os
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from drivers.base import ByteTransport
from drivers.clock import NS_PER_S, Clock
from drivers.estop.base import EstopInput
from drivers.estop.gpio_button import GpioButton
from drivers.estop.gpio_contact import GpioContact
from drivers.estop.hid_button import HidButton
from sim_twin.contracts.bench import ServedBench, WireBench, socket_bench
from sim_twin.contracts.estop import EstopContract, EstopUnplugContract
from sim_twin.contracts.scripted import ManualClock
from sim_twin.sensors.estop import EstopButtonDevice

KEY = 288


def connect(line: ByteTransport, clock: Clock) -> EstopInput:
    return HidButton(line, clock, KEY)


class WiredButton(WireBench[EstopInput]):
    def __init__(self) -> None:
        device = EstopButtonDevice(KEY)
        super().__init__(device, connect, device.announce)
        self.press, self.release = device.press, device.release


class TestHidOnAWire(EstopContract, EstopUnplugContract):
    @pytest.fixture
    def bench(self) -> WiredButton:
        return WiredButton()


class TestHidBehindASocket(EstopContract, EstopUnplugContract):
    @pytest.fixture
    def bench(self, tmp_path: Path) -> Iterator[ServedBench[EstopInput]]:
        device = EstopButtonDevice(KEY)
        bench = socket_bench(device, connect, tmp_path / "estop", device.announce)
        bench.press, bench.release = device.press, device.release  # type: ignore[attr-defined]
        yield bench
        bench.close()


class Chip:
    """Stand in for a chip where libgpiod's Python calls it: request, read, release."""

    def __init__(self) -> None:
        self.plugged = True
        self.pressed = False
        self.wire_whole = True
        self.requests: list[tuple[str, dict[int, Any]]] = []

    def request_lines(self, path: str, *, consumer: str, config: dict[int, Any]) -> "Chip":
        if not self.plugged:
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), path)
        self.requests.append((path, config))
        return self

    def get_value(self, offset: int) -> Enum:
        import gpiod

        if not self.plugged:
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))
        # Pulled up and active low: only a closed contact and a whole wire make it active.
        closed = self.wire_whole and not self.pressed
        value: Enum = gpiod.line.Value.ACTIVE if closed else gpiod.line.Value.INACTIVE
        return value

    def release(self) -> None:
        pass


class GpioBench:
    def __init__(self, chip: Chip) -> None:
        self.clock = ManualClock(NS_PER_S)
        self.chip = chip

    def open(self) -> EstopInput:
        return GpioButton(GpioContact("/dev/gpiochip0", 17), self.clock)

    def let(self, seconds: float) -> None:
        self.clock.ns += round(seconds * NS_PER_S)

    def press(self) -> None:
        self.chip.pressed = True

    def release(self) -> None:
        self.chip.pressed = False

    def unplug(self) -> None:
        self.chip.plugged = False

    def replug(self) -> None:
        self.chip.plugged = True


@pytest.fixture
def gpio(monkeypatch: pytest.MonkeyPatch) -> GpioBench:
    chip = Chip()
    monkeypatch.setattr("gpiod.request_lines", chip.request_lines)
    return GpioBench(chip)


class TestGpioAtItsLibrary(EstopContract, EstopUnplugContract):
    @pytest.fixture
    def bench(self, gpio: GpioBench) -> GpioBench:
        return gpio


def test_the_gpio_line_is_asked_for_as_a_pulled_up_active_low_input(gpio: GpioBench) -> None:
    import gpiod

    gpio.open()
    ((path, config),) = gpio.chip.requests
    settings = config[17]
    assert path == "/dev/gpiochip0"
    assert settings.direction == gpiod.line.Direction.INPUT
    assert settings.bias == gpiod.line.Bias.PULL_UP
    assert settings.active_low


def test_a_broken_wire_reads_as_pressed(gpio: GpioBench) -> None:
    button = gpio.open()
    gpio.let(0.1)
    button.poll()
    gpio.chip.wire_whole = False
    assert button.poll().pressed


def test_a_bouncing_contact_reads_as_pressed_until_it_has_been_closed_for_50_ms(
    gpio: GpioBench,
) -> None:
    button = gpio.open()
    gpio.press()
    button.poll()
    readings = []
    for ms in range(120):
        gpio.chip.pressed = ms in (0, 3, 7, 20)
        gpio.let(0.001)
        readings.append(button.poll().pressed)
    assert readings.index(False) == 21 + 50
    assert not any(readings[readings.index(False) :])


def library_without_gpiod(name: str) -> Any:
    raise ImportError(name)


def test_a_missing_library_is_refused_with_the_extra_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("drivers.gpio.import_module", library_without_gpiod)
    with pytest.raises(Exception, match=r"vla-deploy\[gpio\]"):
        GpioContact("/dev/gpiochip0", 17)


@pytest.mark.parametrize(
    ("code", "kind", "remedy"),
    [
        (errno.EBUSY, "DeviceBusy", "gpioinfo"),
        (errno.EACCES, "DeviceMissing", "group gpio"),
        (errno.ENOENT, "DeviceMissing", "gpiodetect"),
        (errno.EINVAL, "DeviceMissing", "line 99"),
    ],
)
def test_a_refused_line_is_reported_with_the_remedy(
    monkeypatch: pytest.MonkeyPatch, code: int, kind: str, remedy: str
) -> None:
    def refuse(*_: object, **__: object) -> SimpleNamespace:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr("gpiod.request_lines", refuse)
    with pytest.raises(Exception, match=remedy) as caught:
        GpioContact("/dev/gpiochip0", 99)
    assert type(caught.value).__name__ == kind
