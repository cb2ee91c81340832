"""Say in words how the battery is."""

from collections.abc import Mapping
from typing import Any, Final

from vla_deploy.ipc.topics import BATTERY

AGE_S: Final = BATTERY.deadline_s
"""What is older says nothing of the battery now."""
SILENT: Final = "nothing measures it now"


def battery_words(battery: Mapping[str, Any]) -> str:
    """Return the battery on a line: "63 % (estimated), 11.4 V, -2.1 A, charging, low"."""
    charge, current = battery["charge_ratio"], battery["current_a"]
    volts, estimate = battery["voltage_v"], battery["is_estimate"]
    parts = [
        f"{_percent(charge)} %{' (estimated)' if estimate else ''}"
        if charge is not None
        else f"charge unknown ({_why(battery, 'charge_ratio')})",
        "" if volts is None else f"{volts:.1f} V",
        "" if current is None else f"{current:+.1f} A",
        "charging" if battery["is_charging"] else "",
        "critical" if battery["critical"] else "low" if battery["low"] else "",
    ]
    return ", ".join(part for part in parts if part)


def battery_sentences(battery: Mapping[str, Any]) -> str:
    """Return what the robot says when it is asked how full its battery is."""
    charge, volts = battery["charge_ratio"], battery["voltage_v"]
    if charge is None:
        why = _why(battery, "charge_ratio")
        measured = "" if volts is None else f" Its voltage is {volts:.1f} volts."
        return f"I cannot measure how full my battery is: {why}.{measured}"
    about, judged = ("about ", ", judging by its voltage") if battery["is_estimate"] else ("", "")
    told = [f"My battery is {about}{_percent(charge)} percent full{judged}."]
    if battery["is_charging"]:
        told.append("It is charging.")
    if battery["low"]:
        told.append("That is critical." if battery["critical"] else "That is low.")
    return " ".join(told)


def _why(battery: Mapping[str, Any], key: str) -> str:
    reason = str(battery["missing"].get(key, "")).removeprefix("missing, because ")
    return reason or SILENT


def _percent(charge_ratio: float) -> int:
    return round(100 * charge_ratio)
