"""Switch one device beside the steps of a node, and keep what it has told of its state.

Nothing here waits: what is asked for is done by an executor, one task after the other, and taken in
by `refresh`. The state is what was read back, never what was asked for.
"""

from collections import deque
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.devices.errors import DeviceError
from vla_deploy.devices.transport import DeviceReading, SwitchTransport
from vla_deploy.robots.home_devices import HomeDevice

FIRST_BACK_OFF_S: Final = 1.0
LONGEST_BACK_OFF_S: Final = 60.0
_NOT_YET: Final = "it was not looked at yet"


@dataclass(slots=True, kw_only=True, eq=False)
class DeviceTask:
    """Hold one thing to do: switch on or off, or, where `on` is None, look at the state.

    Once `done`, there is a reading or a fault, or it was withdrawn.
    """

    on: bool | None
    reading: DeviceReading | None = None
    fault: DeviceError | None = None
    is_withdrawn: bool = False

    @property
    def done(self) -> bool:
        """Return whether nothing more comes."""
        return self.reading is not None or self.fault is not None or self.is_withdrawn


@dataclass(frozen=True, slots=True, kw_only=True)
class SwitchState:
    """Say what is known of a device: on or off as read at `read_ns`, or unknown with the reason."""

    is_on: bool | None = None
    read_ns: int = 0
    fault: str = _NOT_YET

    @property
    def was_asked(self) -> bool:
        """Return whether the device was asked at all."""
        return self.fault is not _NOT_YET

    def age_s(self, now_ns: int) -> float:
        """Return how old the reading is."""
        return (now_ns - self.read_ns) / NS_PER_S


class SwitchedDevice:
    """Be one device of the home for a node that steps."""

    def __init__(
        self, device: HomeDevice, transport: SwitchTransport, executor: Executor, clock: Clock
    ) -> None:
        self.device = device
        self.state = SwitchState()
        self._transport = transport
        self._executor = executor
        self._clock = clock
        self._tasks: deque[DeviceTask] = deque()
        self._work: Future[DeviceReading] | None = None
        self._next_look_ns = 0
        self._back_off_s = FIRST_BACK_OFF_S

    @property
    def where(self) -> str:
        """Return how the device is reached, for messages."""
        return self._transport.where

    @property
    def called(self) -> str:
        """Return what the device calls itself, fit to be shown; "" where it does not."""
        return self._transport.called

    def switch(self, on: bool) -> DeviceTask:
        """Have the device switched; the task tells the state that was read back."""
        return self._add(DeviceTask(on=on))

    def look(self) -> DeviceTask:
        """Have the state read anew."""
        return self._add(DeviceTask(on=None))

    def withdraw(self, task: DeviceTask) -> None:
        """Do not begin with a task; what has begun cannot be taken back."""
        if not task.done and (self._work is None or task is not self._tasks[0]):
            task.is_withdrawn = True

    def refresh(self) -> None:
        """Take in what is done, begin with what is next; look by itself from time to time."""
        self._take_in()
        if not self._tasks and self._clock.now_ns() >= self._next_look_ns:
            self._tasks.append(DeviceTask(on=None))
        self._begin()
        self._take_in()

    def close(self) -> None:
        """Let go of the device without waiting for it."""
        self._transport.interrupt()
        for task in self._tasks:
            task.is_withdrawn = not task.done
        self._executor.submit(self._transport.close)
        self._executor.shutdown(wait=False)

    def _add(self, task: DeviceTask) -> DeviceTask:
        self._tasks.append(task)
        self.refresh()
        return task

    def _begin(self) -> None:
        while self._tasks and self._work is None:
            if self._tasks[0].is_withdrawn:
                self._tasks.popleft()
                continue
            on = self._tasks[0].on
            if on is None:
                self._work = self._executor.submit(self._transport.read)
            else:
                self._work = self._executor.submit(self._transport.switch, on)

    def _take_in(self) -> None:
        if self._work is None or not self._work.done():
            return
        work, self._work = self._work, None
        task, now_ns = self._tasks.popleft(), self._clock.now_ns()
        try:
            task.reading = work.result()
        except DeviceError as error:
            task.fault = error
            self.state = SwitchState(fault=str(error), read_ns=self.state.read_ns)
            self._next_look_ns = now_ns + round(self._back_off_s * NS_PER_S)
            self._back_off_s = min(2.0 * self._back_off_s, LONGEST_BACK_OFF_S)
        else:
            self.state = SwitchState(is_on=task.reading.is_on, read_ns=now_ns, fault="")
            self._next_look_ns = now_ns + round(self._transport.look_period_s * NS_PER_S)
            self._back_off_s = FIRST_BACK_OFF_S
