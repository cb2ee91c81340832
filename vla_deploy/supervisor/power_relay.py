"""Feed the relay in the servos' supply while supervisor and control are live.

What stops the pulses: the supervisor's death, for it sends them; control that has been silent for
longer than its row says; an emergency stop of a robot all of whose groups have stop category 0. A
control that starts again needs servos that answer, so the supply comes back for it, once the relay
has surely fallen: by then the servos have lost their torque. After an emergency stop the supply
comes back with the operator's reset, which has to find the servos.
"""

import logging
from dataclasses import dataclass
from typing import Final

from drivers.clock import NS_PER_S, Clock
from drivers.errors import DriverError
from drivers.power_relay.base import PowerRelay, RelayOpener
from drivers.power_relay.open_relay import open_relay
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.robots import RobotDescription
from vla_deploy.robots.description import StopCategory
from vla_deploy.robots.devices import PowerRelayDescription
from vla_deploy.supervisor.processes.lifecycle import ProcessState

CONTROL: Final = "control"
_OFF_FOR_S: Final = 1.0
"""How much longer than its own time a relay is left without pulses, so that it has fallen."""
_REOPEN_NS: Final = NS_PER_S // 2
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class RelayInputs:
    """Hold what decides whether the relay is fed; `control_age_s` is None before control spoke."""

    now_ns: int
    control_age_s: float | None
    control: ProcessState
    stopping: bool
    estop_latched: bool
    reset_asked: bool


class RelayRule:
    """Decide whether the relay is fed; pure but for what it remembers of earlier steps."""

    def __init__(self, relay: PowerRelayDescription, *, cut_by_estop: bool) -> None:
        self._silence_s = relay.control_silence_s
        self._off_ns = round(((relay.hold_s or 0.0) + _OFF_FOR_S) * NS_PER_S)
        self._cut_by_estop = cut_by_estop
        self._latched = True
        self._stopped = False
        self._gone_ns: int | None = None

    def feeds(self, seen: RelayInputs) -> bool:
        """Return whether to feed the relay now."""
        if seen.reset_asked:
            self._stopped = False
        elif self._cut_by_estop and seen.estop_latched and not self._latched:
            self._stopped = True
        self._latched = seen.estop_latched
        if self._stopped:
            return False
        if seen.stopping:  # control brings the arms down first, and says nothing meanwhile
            return seen.control is not ProcessState.STOPPED
        if seen.control_age_s is None or seen.control_age_s <= self._silence_s:
            self._gone_ns = None
            return True
        if self._gone_ns is None:
            self._gone_ns = seen.now_ns
        has_fallen = seen.now_ns - self._gone_ns >= self._off_ns
        return has_fallen and seen.control is ProcessState.STARTING


class PowerRelayFeed:
    """Hold the relay open as a device, see what control says, and feed or cut."""

    def __init__(
        self, robot: RobotDescription, devices: RelayOpener, space: SharedSpace, clock: Clock
    ) -> None:
        """Prepare everything that needs no device; a relay that is not there is opened later."""
        assert robot.power_relay is not None, "the robot file has no [power_relay]"
        self._declared = robot.power_relay
        self._devices = devices
        self._clock = clock
        cut_by_estop = all(
            group.stop_category is StopCategory.POWER_REMOVED for group in robot.groups.values()
        )
        self._rule = RelayRule(self._declared, cut_by_estop=cut_by_estop)
        self._status = space.cell_reader(topics.CONTROL_STATUS)
        self._acts = space.ring_reader(topics.OPERATOR, from_start=False)
        self._relay: PowerRelay | None = None
        self._trouble = ""
        self._open_ns = clock.now_ns()
        self._fed = True

    def step(self, control: ProcessState, *, stopping: bool) -> None:
        """Feed the relay or cut it; call it at every step of the supervisor."""
        fed = self._rule.feeds(self._seen(control, stopping=stopping))
        if fed is not self._fed:
            _log.warning("power relay: %s", "fed again" if fed else "no more pulses")
            self._fed = fed
        try:
            relay = self._relay or self._opened(control)
            if relay is not None:
                (relay.feed if fed else relay.cut)()
        except DriverError as error:
            self._lose(str(error))

    def close(self) -> None:
        """Stop feeding and release the device."""
        relay, self._relay = self._relay, None
        if relay is not None:
            relay.close()
        self._status.close()
        self._acts.close()

    def _seen(self, control: ProcessState, *, stopping: bool) -> RelayInputs:
        sample = self._status.latest()
        now_ns = self._clock.now_ns()
        acts = [event.payload["act"] for event in self._acts.drain()]
        return RelayInputs(
            now_ns=now_ns,
            control_age_s=None if sample is None else sample.age_s(now_ns),
            control=control,
            stopping=stopping,
            estop_latched=sample is not None and sample.document()["estop_latched"],
            reset_asked="reset" in acts,
        )

    def _opened(self, control: ProcessState) -> PowerRelay | None:
        """Open the relay, not before control's turn to start: the twin's comes with the twin."""
        if control is ProcessState.WAITING or self._clock.now_ns() < self._open_ns:
            return None
        declared = self._declared
        self._relay = open_relay(
            declared.model, self._devices, declared.device, self._clock, number=declared.number
        )
        self._trouble = ""
        return self._relay

    def _lose(self, trouble: str) -> None:
        if trouble != self._trouble:
            _log.error("power relay: %s; the servos lose their supply", trouble)
        self._trouble = trouble
        self._open_ns = self._clock.now_ns() + _REOPEN_NS
        relay, self._relay = self._relay, None
        if relay is not None:
            relay.close()
