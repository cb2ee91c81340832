"""The kernel's interface: ioctl requests as in linux/input.h, the state first, then the events."""

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from drivers.clock import MonotonicClock
from drivers.errors import DeviceBusy, DeviceMissing, LinkLost
from drivers.estop.base import ButtonState
from drivers.estop.hid_button import HidButton
from drivers.estop.input_device import (
    EVIOCGBIT_KEY,
    EVIOCGKEY,
    EVIOCGRAB,
    EVIOCSCLOCKID,
    InputDevice,
)
from drivers.estop.input_event import key_report

KEY = 288
CLOCK = MonotonicClock()


@dataclass
class Kernel:
    """Answer what evdev answers; the events themselves pass through a FIFO."""

    down: set[int] = field(default_factory=set)
    present: set[int] = field(default_factory=lambda: {30, KEY})
    asked: list[int] = field(default_factory=list)
    refuse: int | None = None

    def ioctl(self, fd: int, request: int, argument: bytearray, /) -> int:
        self.asked.append(request)
        if request == self.refuse:
            raise OSError(16, "Device or resource busy")
        codes = {EVIOCGBIT_KEY: self.present, EVIOCGKEY: self.down}.get(request, set())
        for code in codes:
            argument[code // 8] |= 1 << code % 8
        return 0


@pytest.fixture
def fifo(tmp_path: Path) -> Path:
    path = tmp_path / "event-kbd"
    os.mkfifo(path)
    return path


@pytest.fixture
def sender(fifo: Path) -> Iterator[int]:
    reader = os.open(fifo, os.O_RDONLY | os.O_NONBLOCK)
    writer = os.open(fifo, os.O_WRONLY)
    os.close(reader)
    yield writer
    os.close(writer)


def test_the_requests_are_those_of_the_kernels_header() -> None:
    # _IOR('E', 0x18, 96), _IOR('E', 0x21, 96), _IOW('E', 0x90, int), _IOW('E', 0xa0, int)
    assert EVIOCGKEY == 0x80604518
    assert EVIOCGBIT_KEY == 0x80604521
    assert EVIOCGRAB == 0x40044590
    assert EVIOCSCLOCKID == 0x400445A0


@pytest.mark.parametrize(
    ("down", "state"), [(set(), ButtonState.RELEASED), ({KEY}, ButtonState.PRESSED)]
)
def test_the_state_at_opening_comes_before_any_event(
    fifo: Path, sender: int, down: set[int], state: ButtonState
) -> None:
    button = HidButton(InputDevice(fifo, CLOCK, ioctl=Kernel(down).ioctl), CLOCK, KEY)
    assert button.poll().state is state
    os.write(sender, key_report(KEY, down=True, now_ns=0))
    assert button.poll().state is ButtonState.PRESSED
    os.write(sender, key_report(KEY, down=False, now_ns=0))
    assert button.poll().state is ButtonState.RELEASED
    button.close()


def test_a_device_without_the_key_never_reads_as_released(fifo: Path, sender: int) -> None:
    kernel = Kernel(present={30})
    button = HidButton(InputDevice(fifo, CLOCK, ioctl=kernel.ioctl), CLOCK, KEY)
    reading = button.poll()
    assert reading.state is ButtonState.UNKNOWN
    assert "288" in reading.reason
    button.close()


def test_a_device_that_hangs_up_is_a_lost_link(fifo: Path) -> None:
    reader = os.open(fifo, os.O_RDONLY | os.O_NONBLOCK)
    writer = os.open(fifo, os.O_WRONLY)
    device = InputDevice(fifo, CLOCK, ioctl=Kernel().ioctl)
    os.close(reader)
    os.close(writer)
    with pytest.raises(LinkLost, match="plug the button in again"):
        device.discard_input()
    device.close()
    device.close()


def test_it_is_grabbed_only_on_request_and_a_grab_by_another_is_reported(
    fifo: Path, sender: int
) -> None:
    kernel = Kernel()
    InputDevice(fifo, CLOCK, ioctl=kernel.ioctl).close()
    assert EVIOCGRAB not in kernel.asked
    InputDevice(fifo, CLOCK, grab=True, ioctl=kernel.ioctl).close()
    assert EVIOCGRAB in kernel.asked
    kernel.refuse = EVIOCGRAB
    with pytest.raises(DeviceBusy, match="grabbed"):
        InputDevice(fifo, CLOCK, grab=True, ioctl=kernel.ioctl)


def test_a_file_that_is_no_input_device_is_refused(fifo: Path, sender: int) -> None:
    with pytest.raises(DeviceMissing, match=r"not an input device.*by-id"):
        InputDevice(fifo, CLOCK)


def test_a_missing_path_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DeviceMissing, match="plug the button in"):
        InputDevice(tmp_path / "event-kbd", CLOCK)


def test_a_button_takes_no_data(fifo: Path, sender: int) -> None:
    device = InputDevice(fifo, CLOCK, ioctl=Kernel().ioctl)
    with pytest.raises(NotImplementedError):
        device.write(b"x")
    device.close()
