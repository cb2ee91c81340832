"""Keep the servo bus: open, lose and reopen it, and take servos in and out of power one by one."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S, Clock
from drivers.error_budget import BudgetState
from drivers.errors import DriverError, LinkLost, NoReply
from drivers.opener import DeviceOpener
from drivers.servo.bus import ServoBusDriver
from drivers.servo.shadowed_bus import ShadowedBus
from drivers.servo.state import BusState
from drivers.servo.wheeled_bus import WheeledBus
from platforms import Profile
from vla_deploy.control.motion.axes import Axes, Floats
from vla_deploy.control.output.servo_faults import ServoFaults
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.servos.declared import bus_family, servo_specs

REOPEN_NS = NS_PER_S
_REOPEN_WHEELS_NS = NS_PER_S // 5
"""Wheels go on turning while nobody talks to them: their line is tried again sooner."""
_FIRST_READS = 10


class ServoLine:
    """Own the bus of all servos; a lost link is remembered, not raised, after `open`."""

    def __init__(
        self, robot: RobotDescription, profile: Profile, devices: DeviceOpener, clock: Clock
    ) -> None:
        self.name = robot.servo_bus.device
        self.lost = False
        self.failure = ""
        self.faults = ServoFaults()
        self._devices = devices
        self._clock = clock
        self._baud = robot.servo_bus.baud
        self._never_moves = robot.never_moves
        self._watchdog_s = profile.bus_watchdog_s
        self._family = bus_family(robot)
        self._specs = servo_specs(robot)
        bus = robot.servo_bus
        self._ids = [servo.id for servo in (*bus.servos, *bus.wheels)]
        self.wheel_rows: Axes = np.arange(len(bus.servos), len(self._ids))
        """The places, behind those of the joints, of the servos that turn wheels."""
        self.wheel_names = robot.wheel_joints
        self.wheels = BusState.of(len(bus.wheels))
        self._leaders = [robot.joint_index[one.joint] for one in robot.servo_bus.shadows]
        self._bus: ServoBusDriver | None = None
        self._next_open_ns = self._aged_ns = 0
        self._reopen_ns = _REOPEN_WHEELS_NS if bus.wheels else REOPEN_NS
        self.state = BusState.of(len(bus.servos))

    def open(self, *, thorough: bool = True) -> None:
        """Connect and read once; torque is left as the servos have it.

        Unless `thorough` the first silent servo ends it, so that a tick is not held up for seconds.

        Raises:
            DriverError: the line is missing or busy, or a servo is silent or not as declared.
        """
        transport = self._devices.serial(self.name)
        bus: ServoBusDriver = self._family.bus(
            transport,
            self._clock,
            self._specs,
            baud=self._baud,
            watchdog_s=self._watchdog_s,
            fault_policy=self.faults.policy,
        )
        wheeled = None
        if len(self.wheel_rows):
            bus = wheeled = WheeledBus(bus, len(self.wheel_rows))
        if self._leaders:
            bus = ShadowedBus(bus, self._leaders)
        try:
            bus.connect(thorough=thorough)
            self.state = _first_state(bus)
        except DriverError:
            bus.close()
            raise
        self._bus = bus
        self.wheels = self.wheels if wheeled is None else wheeled.wheels
        self.lost = False

    def try_reopen(self) -> bool:
        """Open a lost line again, at most once a second, and tell whether it is back."""
        if not self.lost or self._clock.now_ns() < self._next_open_ns:
            return False
        self._next_open_ns = self._clock.now_ns() + self._reopen_ns
        try:
            self.open(thorough=False)
        except DriverError as error:
            self.failure = str(error)
            return False
        self.failure = ""
        return True

    @property
    def counters(self) -> dict[str, Any]:
        """Return what the bus tells of itself; empty while it is not open."""
        return {} if self._bus is None else {**self._bus.telemetry(), "faults": self.faults.newest}

    @property
    def lost_parts(self) -> tuple[str, ...]:
        """Name what cannot be relied on: the line, or servos whose error budget is used up."""
        if self.lost:
            return (self.name,)
        if self._bus is None or self._bus.journal.budget.quiet:
            return ()
        budget = self._bus.journal.budget
        judged = [(self.name, budget.bus), *zip(budget.names, budget.members, strict=True)]
        return tuple(
            f"{name}: too many answers missing or damaged"
            for name, state in judged
            if state is BudgetState.LOST
        )

    @property
    def watchdog_tripped(self) -> NDArray[np.bool_]:
        """Return which servos have stopped by themselves."""
        return self.state.watchdog < 0

    @property
    def unguarded(self) -> Axes:
        """Return the servos that hold no torque under a watchdog, or command, of this bus."""
        return np.flatnonzero(~self.state.torque_on | (self.state.watchdog <= 0))

    @property
    def faulted_but_holding(self) -> list[str]:
        """Name the joints that report an error and still hold: rebooted, they would let go."""
        holding = np.flatnonzero((self.state.error != 0) & self.state.torque_on)
        return [self._specs[servo].joint for servo in holding]

    def read(self) -> None:
        """Refresh `state`; values grow old while the line is lost."""
        if self._bus is None or self.lost:
            self._age()
            return
        try:
            self._bus.read_state()
        except LinkLost as error:
            self._note_loss(error)
            return
        if self._bus.journal.has_decisions:
            self._attempt(self.faults.carry_out)

    def write(self, goals: Floats) -> None:
        """Send a goal to every servo."""
        if self._bus is None or self.lost:
            return
        try:
            self._bus.write_goals(goals)
        except LinkLost as error:
            self._note_loss(error)

    def write_speeds(self, speed_rad_s: Floats) -> None:
        """Send a speed to every wheel."""
        if self._bus is None or self.lost:
            return
        try:
            self._bus.write_speeds(speed_rad_s)
        except LinkLost as error:
            self._note_loss(error)

    def energise(self, servo: int) -> bool:
        """Hold one servo where it is, its watchdog armed; False with `failure` when it refuses."""
        if self._never_moves:
            self.failure = self._never_moves
            return False
        return self._attempt(lambda bus: self._energise(bus, self._ids[servo]))

    def clear_watchdogs(self) -> bool:
        """Let servos that have stopped by themselves take goals again."""
        return self._attempt(lambda bus: bus.clear_watchdog())

    def reboot_faulted(self) -> bool:
        """Restart the servos that report a hardware error, the only way out of it."""
        return self._attempt(self._reboot_faulted)

    def reboot(self, servos: Sequence[int]) -> bool:
        """Restart these servos, whatever they report."""
        self.faults.policy.acknowledge()
        return self._attempt(lambda bus: _reboot_each(bus, [self._ids[servo] for servo in servos]))

    def remove_power(self, servos: Axes) -> bool:
        """Switch torque off; False with `failure` when a servo did not confirm it."""
        return self._attempt(lambda bus: self._disable(bus, servos))

    def limit_effort(self, ratios: dict[int, float]) -> bool:
        """Bound the duty of some servos, given by their place in the joint order."""
        by_id = {self._ids[servo]: ratio for servo, ratio in ratios.items()}
        return self._attempt(lambda bus: _raise_first(bus.limit_effort(by_id)))

    def close(self) -> None:
        """Release the line; the servos keep what they do until their watchdog stops them."""
        bus, self._bus = self._bus, None
        if bus is not None:
            bus.close()

    def _energise(self, bus: ServoBusDriver, servo_id: int) -> None:
        bus.enable_torque([servo_id])

    def _disable(self, bus: ServoBusDriver, servos: Axes) -> None:
        if len(servos) > 0:
            _raise_first(bus.disable_torque([self._ids[servo] for servo in servos]))

    def _reboot_faulted(self, bus: ServoBusDriver) -> None:
        self.faults.policy.acknowledge()
        for servo in np.flatnonzero(self.state.error):
            bus.reboot(self._ids[servo])

    def _attempt(self, act: Callable[[ServoBusDriver], None]) -> bool:
        if self._bus is None or self.lost:
            self.failure = f"{self.name}: the servo bus is lost"
            return False
        try:
            act(self._bus)
        except LinkLost as error:
            self._note_loss(error)
            return False
        except DriverError as error:
            self.failure = str(error)
            return False
        return True

    def _age(self) -> None:
        now_ns = self._clock.now_ns()
        for state in (self.state, self.wheels):
            state.age_s += (now_ns - self._aged_ns) / NS_PER_S
        self._aged_ns = now_ns

    def _note_loss(self, error: LinkLost) -> None:
        self.failure = str(error)
        self.lost = True
        self._aged_ns = self._clock.now_ns()
        self.close()


def _first_state(bus: ServoBusDriver) -> BusState:
    """Read until every servo has told its position once."""
    for _ in range(_FIRST_READS):
        state = bus.read_state()
        if np.isfinite(state.position_rad).all():
            return state
    silent = np.flatnonzero(~np.isfinite(state.position_rad))
    raise NoReply(f"no position from {', '.join(str(bus.servos[n]) for n in silent)}; see cables")


def _reboot_each(bus: ServoBusDriver, ids: Sequence[int]) -> None:
    for servo_id in ids:
        bus.reboot(servo_id)


def _raise_first(failures: dict[int, DriverError]) -> None:
    for error in failures.values():
        raise error
