"""Say why the robot may not move now, from what control says of itself."""

from collections.abc import Mapping
from typing import Any

REMEDIES: Mapping[str, str] = {
    "disarmed": "the robot is disarmed; arm it first: vla-deploy arm",
    "stopping": "the robot is stopping{cause}; then reset and arm it: vla-deploy reset, "
    "vla-deploy arm",
    "stopped": "the robot is stopped{cause}; reset and arm it first: vla-deploy reset, "
    "vla-deploy arm",
    "fault": "control reports a fault{cause}; mend it, then: vla-deploy reset, vla-deploy arm",
}
SILENT = "control does not answer; see: vla-deploy status"


def refusal_of(status: Mapping[str, Any] | None) -> str | None:
    """Return why motion is refused, or None when the robot is armed.

    A protective stop is no refusal: it ends by itself, and the executor waits for that.
    """
    if status is None:
        return SILENT
    if status.get("never_moves"):
        return str(status["never_moves"])
    remedy = REMEDIES.get(str(status["state"]))
    if remedy is None:
        return None
    words = [str(status.get(key, "")) for key in ("cause", "detail") if status.get(key)]
    return remedy.format(cause=f" ({': '.join(words)})" if words else "")
