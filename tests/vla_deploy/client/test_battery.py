"""One value says the same on a line and aloud."""

from typing import Any

import pytest

from vla_deploy.client.battery import battery_sentences, battery_words

FULL: dict[str, Any] = {
    "charge_ratio": 0.634,
    "voltage_v": 25.91,
    "current_a": -2.1,
    "is_charging": False,
    "is_estimate": False,
    "low": False,
    "critical": False,
    "missing": {},
}
BLIND = {
    "charge_ratio": None,
    "is_charging": None,
    "current_a": None,
    "missing": {"charge_ratio": "missing, because there is no /sys/class/power_supply/BAT0"},
}


@pytest.mark.parametrize(
    ("changes", "line", "sentences"),
    [
        ({}, "63 %, 25.9 V, -2.1 A", "My battery is 63 percent full."),
        ({"is_charging": True, "current_a": 5.0}, "63 %, 25.9 V, +5.0 A, charging",
         "My battery is 63 percent full. It is charging."),
        ({"is_estimate": True, "current_a": None, "is_charging": None}, "63 % (estimated), 25.9 V",
         "My battery is about 63 percent full, judging by its voltage."),
        ({"charge_ratio": 0.2, "low": True}, "20 %, 25.9 V, -2.1 A, low",
         "My battery is 20 percent full. That is low."),
        ({"charge_ratio": 0.05, "low": True, "critical": True}, "5 %, 25.9 V, -2.1 A, critical",
         "My battery is 5 percent full. That is critical."),
        (BLIND, "charge unknown (there is no /sys/class/power_supply/BAT0), 25.9 V",
         "I cannot measure how full my battery is: there is no /sys/class/power_supply/BAT0. "
         "Its voltage is 25.9 volts."),
    ],
)  # fmt: skip
def test_it_is_told_on_a_line_and_aloud(changes: dict[str, Any], line: str, sentences: str) -> None:
    told = {**FULL, **changes}
    assert battery_words(told) == line
    assert battery_sentences(told) == sentences
