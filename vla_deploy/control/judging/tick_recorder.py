"""Record each tick so that it can be judged again, also when this process is killed in it."""

from dataclasses import fields
from operator import attrgetter

from vla_deploy.control.motion.axes import Floats
from vla_deploy.control.motion.base_velocity import BaseVelocity
from vla_deploy.ipc import SharedSpace, topics
from vla_deploy.ipc.memory.delta import DeltaWriter
from vla_deploy.ipc.memory.packing import Catalogue, types_within
from vla_deploy.safety import SafetyInputs, SafetyLimits, SafetyState, Verdict

_INPUTS = tuple(field.name for field in fields(SafetyInputs))
_JUDGED = (
    *("tick", "now_ns", "state", "limits", "verdict"),
    *(f"inputs.{name}" for name in _INPUTS),
)
_SENT = ("sent", *(f"sent_{name}" for name in BaseVelocity._fields))
_read_inputs = attrgetter(*_INPUTS)
_KEY_EVERY = 250


class TickRecorder:
    """Write the `tick_record` topic: state, inputs, limits and verdict, then what was sent."""

    def __init__(self, space: SharedSpace) -> None:
        catalogue = Catalogue(types_within(SafetyState, SafetyInputs, SafetyLimits, Verdict))
        self._ring = space.record_writer(topics.TICK_RECORD)
        self._delta = DeltaWriter((*_JUDGED, *_SENT), catalogue, key_every=_KEY_EVERY)
        self._is_open = False

    def judged(
        self,
        tick: int,
        now_ns: int,
        state: SafetyState,
        inputs: SafetyInputs,
        limits: SafetyLimits,
        verdict: Verdict,
    ) -> None:
        """Keep what the tick was judged by; `state` is the one before."""
        self._delta.put(0, (tick, now_ns, state, limits, verdict, *_read_inputs(inputs)))
        self._is_open = True

    def sent(self, setpoint: Floats, velocity: BaseVelocity) -> None:
        """Record the tick with what it sent to joints and wheels."""
        self._append(setpoint, *velocity)

    def close(self) -> None:
        """Record a tick that was judged and did not come to its end, and unmap the topic."""
        if self._is_open:
            self._append(*(None for _ in _SENT))
        self._ring.close()

    def _append(self, *sent: Floats | float | None) -> None:
        self._delta.put(len(_JUDGED), sent)
        self._ring.append(self._delta.record())
        self._is_open = False
