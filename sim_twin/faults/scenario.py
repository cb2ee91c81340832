"""Load scenarios: the faults, what the robot does meanwhile, and what it must do about them."""

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, Final

from sim_twin.errors import FaultRefused
from sim_twin.faults.request import FaultRequest, parse_request
from vla_deploy.ipc.payloads.motion import OperatorActName
from vla_deploy.robots import RobotDescription
from vla_deploy.runtime.table_schema import parse_toml

SCENARIOS: Final = Path(__file__).with_name("scenarios")
NO_CAUSE: Final = "none"
ACTS: Final = ("reset", "arm")
_KEYS: Final = frozenset({"summary", "meanwhile", "faults", "expect"})


class Meanwhile(Enum):
    """Name what the robot does when the fault strikes; travels and turns are the whole stack's."""

    HOLD = "hold"
    REACH = "reach"
    DRIVE = "drive"
    TRAVEL = "travel"
    TURN = "turn"

    @property
    def takes_all(self) -> bool:
        """Return whether it takes the whole stack and not control alone."""
        return self in (Meanwhile.TRAVEL, Meanwhile.TURN)


@dataclass(frozen=True, slots=True, kw_only=True)
class Expectation:
    """State what the stack must do.

    cause           what control stops for, "none": it must go on armed all the time
    within_s        from the fault's beginning to the cause being told
    rest_within_s   from the fault's beginning until nothing moves any more (wheels, on a travel)
    torque          "kept" or "off": the servos' own registers after the stop
    stale_joints    exactly these grow old while the fault is on, ["all"] for every one
    alert           a joint whose servo must report a hardware error
    stale_topics    these must go stale while the fault is on; no other one may
    counts          counters of a bus that must rise, as "servos.crc_errors"
    runs_back       once the fault has gone, a servo itself runs back: no command of control's
    recovery        the acts that bring the robot back to armed once the fault has gone
    pose_error_m    how far perception's pose may be off while the fault is on and after it
    yaw_error_rad   likewise, for its heading
    travel          what becomes of the command on a travel or turn: "succeeds" or "fails"
    """

    cause: str
    within_s: float = 0.0
    rest_within_s: float | None = None
    torque: str | None = None
    stale_joints: tuple[str, ...] | None = None
    alert: str | None = None
    stale_topics: tuple[str, ...] | None = None
    counts: tuple[str, ...] = ()
    runs_back: bool = False
    recovery: tuple[OperatorActName, ...] = ()
    pose_error_m: float | None = None
    yaw_error_rad: float | None = None
    travel: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """Hold a checked scenario; times count from its beginning."""

    name: str
    summary: str
    meanwhile: Meanwhile
    faults: tuple[FaultRequest, ...]
    expect: Expectation

    @property
    def begin_s(self) -> float:
        """Return when the first fault begins."""
        return min(fault.timing.start_s for fault in self.faults)

    @property
    def end_s(self) -> float:
        """Return when the last fault has ended."""
        ends = (fault.timing.start_s + (fault.timing.duration_s or 0.0) for fault in self.faults)
        return max(ends)


def scenario_paths() -> list[Path]:
    """Return the scenarios that ship with the twin."""
    return sorted(SCENARIOS.glob("*.toml"))


def load_scenario(path: Path, robot: RobotDescription) -> Scenario:
    """Return a scenario, checked against the table of faults and the robot.

    Raises:
        FaultRefused: the file cannot be read, or anything in it is unknown or out of range.
    """
    try:
        raw = parse_toml(path.read_text(encoding="utf-8"))
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise FaultRefused(f"{path}: {error}") from error
    return parse_scenario(path.stem, raw, robot)


def parse_scenario(name: str, raw: Mapping[str, Any], robot: RobotDescription) -> Scenario:
    """Return a scenario, checked against the table of faults and the robot.

    Raises:
        FaultRefused: anything in it is missing, unknown or out of range.
    """
    unknown = sorted(set(raw) - _KEYS)
    if unknown:
        raise FaultRefused(f"{name}: {unknown[0]}: unknown; expected {', '.join(sorted(_KEYS))}")
    faults = _part(name, raw, "faults", list)
    if not faults:
        raise FaultRefused(f"{name}: faults: expected at least one, got none")
    return Scenario(
        name=name,
        summary=_part(name, raw, "summary", str),
        meanwhile=_meanwhile(name, _part(name, raw, "meanwhile", str)),
        faults=tuple(_lasting(name, parse_request(fault, robot)) for fault in faults),
        expect=_expectation(name, _part(name, raw, "expect", dict)),
    )


def _part(name: str, raw: Mapping[str, Any], key: str, kind: type) -> Any:
    if not isinstance(raw.get(key), kind):
        raise FaultRefused(f"{name}: {key}: expected a {kind.__name__}, got {raw.get(key)!r}")
    return raw[key]


def _meanwhile(name: str, given: str) -> Meanwhile:
    try:
        return Meanwhile(given)
    except ValueError:
        known = ", ".join(each.value for each in Meanwhile)
        raise FaultRefused(f"{name}: meanwhile: expected one of {known}; got {given!r}") from None


def _lasting(name: str, request: FaultRequest) -> FaultRequest:
    if request.timing.duration_s is None:
        raise FaultRefused(f"{name}: {request.label}: duration_s: a scenario's faults must end")
    return request


def _expectation(name: str, raw: Mapping[str, Any]) -> Expectation:
    unknown = sorted(set(raw) - set(_CHECKS))
    if unknown or "cause" not in raw:
        what = f"{unknown[0]}: unknown" if unknown else "cause: missing"
        raise FaultRefused(f"{name}: expect.{what}; expected of {', '.join(_CHECKS)}")
    wrong = [key for key, value in raw.items() if not _CHECKS[key](value)]
    if wrong:
        raise FaultRefused(f"{name}: expect.{wrong[0]}: cannot be {raw[wrong[0]]!r}")
    checked: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in raw.items()
    }
    return Expectation(**checked)


def _is_positive(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0.0 < value < 60.0


def _is_text(value: object) -> bool:
    return isinstance(value, str) and bool(value)


def _are_texts(value: object) -> bool:
    return isinstance(value, list) and all(map(_is_text, value))


def _are_acts(value: object) -> bool:
    return isinstance(value, list) and all(act in ACTS for act in value)


_CHECKS: Final[Mapping[str, Callable[[object], bool]]] = {
    "cause": _is_text,
    "within_s": _is_positive,
    "rest_within_s": _is_positive,
    "torque": lambda value: value in ("kept", "off"),
    "stale_joints": _are_texts,
    "alert": _is_text,
    "stale_topics": _are_texts,
    "counts": _are_texts,
    "runs_back": lambda value: isinstance(value, bool),
    "recovery": _are_acts,
    "pose_error_m": _is_positive,
    "yaw_error_rad": _is_positive,
    "travel": lambda value: value in ("succeeds", "fails"),
}
