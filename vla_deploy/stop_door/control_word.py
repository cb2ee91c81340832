"""Tell what control says of itself, so that whoever pressed learns that the robot stops."""

from dataclasses import dataclass
from typing import Final

from drivers.clock import Clock
from vla_deploy.ipc import SharedSpace

_AGE_LIMIT_S: Final = 1.0
_SILENT: Final = "control is silent; use the emergency stop button on the robot"


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlWord:
    """Hold control's state as of `age_s` ago."""

    state: str
    estop_latched: bool
    age_s: float


def in_words(word: ControlWord | None) -> str:
    """Return control's state for a person."""
    if word is None:
        return _SILENT
    latched = ", emergency stop latched" if word.estop_latched else ""
    return f"control: {word.state.replace('_', ' ')}{latched}"


class ControlWords:
    """Read the newest word of control, None where there is none that young, or it is none."""

    def __init__(self, space: SharedSpace, clock: Clock) -> None:
        self._clock = clock
        self._status = space.cell_reader("control_status")

    def newest(self) -> ControlWord | None:
        """Return what control has told within the last second."""
        sample = self._status.latest()
        if sample is None or (age_s := sample.age_s(self._clock.now_ns())) > _AGE_LIMIT_S:
            return None
        try:
            told = sample.document()
            state, latched = str(told["state"]), bool(told["estop_latched"])
        except (KeyError, TypeError, ValueError):
            return None  # as of another version: for the one who presses it is as good as silent
        return ControlWord(state=state, estop_latched=latched, age_s=round(max(age_s, 0.0), 3))
