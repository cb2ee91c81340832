"""Say why control takes no motion in a mode, and what to do about it."""

from vla_deploy.control.modes.state_machine import Mode
from vla_deploy.safety import Reaction, Verdict


def refusal_in(mode: Mode, verdict: Verdict, *, estop_latched: bool) -> str:
    """Return the reason for a command that is refused; control that is armed refuses none."""
    if estop_latched:
        return "the emergency stop is latched: reset, then arm"
    if verdict.reaction >= Reaction.HOLD:
        latched = "reset, then arm" if verdict.latched else "remove the cause, then arm"
        return f"stopped by {verdict.text}: {latched}"
    if mode in (Mode.PAUSING, Mode.PAUSED):
        return f"protective stop by {verdict.text or 'a cause that is gone'}: wait"
    return f"control is {mode.value}: arm first"
