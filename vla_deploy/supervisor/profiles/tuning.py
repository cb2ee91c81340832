"""Choose a profile's values by what was observed under it: rates, budgets, the detector's file."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Final

from platforms.profile_check import MIN_WATCHDOG_PERIODS
from platforms.profile_source import Table
from platforms.toml_text import toml_value
from vla_deploy.supervisor.errors import ProfileDoesNotFit
from vla_deploy.supervisor.profiles.observation import LATE_RATIO, STAND_IN, Observation

CONTROL_RATES_HZ: Final = (1000, 500, 250, 200, 125, 100, 50)
LEAST_PERCEPTION_HZ: Final = 1.0
_STEP_HZ: Final = 0.5
_HOT_WITHIN_C: Final = 10.0
"""So near to its limit of temperature, perception is slowed before the ladder has to."""
_COOLER: Final = 0.75
_HALF: Final = 0.5
_WORTH_A_CHANGE: Final = 1.1
"""A file of a model has to be so much faster than the one in use."""
_PROVIDER: Final = "ExecutionProvider"
_LEAST_CPU: Final = 0.05
_LEAST_MB: Final = 10.0
_COARSE_MB: Final = 100
_FEW_REMEMBERED: Final = 500
_BEAM_OF_ONE: Final = 1


class TuningMode(StrEnum):
    """Name what a profile should spare."""

    BALANCED = "balanced"
    LOW_POWER = "low-power"
    EFFICIENT_VISION = "efficient-vision"
    LOW_MEMORY = "low-memory"


@dataclass(frozen=True, slots=True, kw_only=True)
class Computer:
    """Hold what there is to share: cores, and memory in MB."""

    cpu_count: int
    memory_mb: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelTime:
    """Hold how long a detector takes for an image by one provider and precision."""

    provider: str
    precision: str
    frame_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TunedValue:
    """Hold a value that differs from the profile's, by its dotted key, and the reason."""

    key: str
    before: Any
    after: Any
    why: str


@dataclass(slots=True, kw_only=True)
class _Draft:
    """Collect choices; a later one of the same key replaces the earlier."""

    values: Table
    made: dict[str, TunedValue] = field(default_factory=dict)

    def get(self, key: str) -> Any:
        """Return a value as it stands now; None where the profile has no such key."""
        if key in self.made:
            return self.made[key].after
        value: Any = self.values
        for part in key.split("."):
            if part not in value:
                return None
            value = value[part]
        return value

    def set(self, key: str, after: Any, why: str) -> None:
        """Choose a value, unless it is the present one."""
        if after != self.get(key):
            before = self.made[key].before if key in self.made else self.get(key)
            self.made[key] = TunedValue(key=key, before=before, after=after, why=why)


def tuned(
    observed: Observation,
    values: Table,
    computer: Computer,
    *,
    margin: float,
    mode: TuningMode = TuningMode.BALANCED,
    detectors: Sequence[ModelTime] = (),
) -> tuple[TunedValue, ...]:
    """Return what of a profile's values to change, so that `margin` of the computer stays free.

    Raises:
        ProfileDoesNotFit: no rates and budgets fit this computer.
    """
    draft = _Draft(values=values)
    _board(draft, computer)
    _detector(draft, detectors)
    _spare(draft, mode)
    needs = {name: need.cpu_ratio for name, need in observed.processes.items()}
    _control(draft, observed, needs, margin)
    _perception(draft, observed, needs, computer, margin, mode)
    _budgets(draft, observed, needs, computer, margin)
    return tuple(draft.made.values())


def _board(draft: _Draft, computer: Computer) -> None:
    """Declare what is here: a kernel keeps some memory for itself, another one more."""
    memory_mb = int(computer.memory_mb / _COARSE_MB) * _COARSE_MB
    for key, has in (("cpu_count", computer.cpu_count), ("memory_mb", memory_mb)):
        draft.set(f"board.{key}", has, "what this computer has")


def _detector(draft: _Draft, times: Sequence[ModelTime]) -> None:
    """Choose the fastest file: those of int8 are kept only where they see as well."""
    providers = draft.get("models.detector.providers")
    if not times or not providers:
        return
    best = min(times, key=lambda one: one.frame_s)
    in_use = [
        one
        for one in times
        if one.provider == providers[0] and one.precision == draft.get("models.detector.precision")
    ]
    if in_use and in_use[0].frame_s < _WORTH_A_CHANGE * best.frame_s:
        return
    measured = ", ".join(
        f"{one.provider.removesuffix(_PROVIDER)} {one.precision} {one.frame_s * 1e3:.0f} ms"
        for one in times
    )
    rest = [name for name in providers if name != best.provider]
    draft.set("models.detector.providers", [best.provider, *rest], f"measured: {measured}")
    draft.set("models.detector.precision", best.precision, f"measured: {measured}")


def _spare(draft: _Draft, mode: TuningMode) -> None:
    """Choose what a mode gives up beside perception's rate."""
    if mode is TuningMode.LOW_POWER:
        draft.set("speech.beam", _BEAM_OF_ONE, "low-power: the recogniser's quickest search")
    if mode is TuningMode.EFFICIENT_VISION and draft.get("models.detector") is not None:
        tiers = draft.get("models.detector.tiers")
        draft.set("models.detector.tiers", tiers[-1:], "efficient-vision: the smallest tier")
    if mode is TuningMode.LOW_MEMORY:
        draft.set("planning.remembered", _FEW_REMEMBERED, "low-memory")
        for role, model in draft.values.get("models", {}).items():
            draft.set(f"models.{role}.memory_arena", False, "low-memory: given back after a run")
            draft.set(f"models.{role}.tiers", model["tiers"][-1:], "low-memory: the smallest tier")


def _control(draft: _Draft, observed: Observation, needs: dict[str, float], margin: float) -> None:
    """Choose the highest rate at which control leaves its core the margin, and is on time."""
    declared_hz = draft.get("control_rate_hz")
    need, late = needs.get("control", 0.0), observed.late_ratio or 0.0
    reached = observed.rates.get("control_rate_hz")
    slow = late > LATE_RATIO or (reached is not None and not reached.kept)
    if not slow and need <= 1.0 - margin:
        return
    watchdog_s = min(draft.get("bus_watchdog_s"), draft.get("can_heartbeat_s"))
    fitting = [
        rate_hz
        for rate_hz in CONTROL_RATES_HZ
        if rate_hz < declared_hz
        and need * rate_hz / declared_hz <= 1.0 - margin
        and rate_hz * watchdog_s >= MIN_WATCHDOG_PERIODS
    ]
    if not fitting:
        raise ProfileDoesNotFit(
            f"control needs {need:.2f} cores at {declared_hz:g} Hz with {late:.1%} of its ticks "
            f"late, and no lower rate keeps {margin:.0%} of a core free: this computer is too slow "
            "for this robot, or something else runs on it"
        )
    why = f"{need:.2f} cores and {late:.1%} late ticks at {declared_hz:g} Hz"
    draft.set("control_rate_hz", fitting[0], why)
    needs["control"] = need * fitting[0] / declared_hz


def _perception(
    draft: _Draft,
    observed: Observation,
    needs: dict[str, float],
    computer: Computer,
    margin: float,
    mode: TuningMode,
) -> None:
    """Choose the share of perception's rate that all cores, the temperature and the mode leave."""
    share, why = min(_shares(draft, observed, needs, computer, margin, mode), default=(1.0, ""))
    if share >= 1.0:
        return
    declared_hz = draft.get("perception_rate_hz")
    rate_hz = max(LEAST_PERCEPTION_HZ, math.floor(declared_hz * share / _STEP_HZ) * _STEP_HZ)
    rate_hz = min(rate_hz, declared_hz)
    draft.set("perception_rate_hz", rate_hz, why)
    draft.set("camera_rate_hz", max(1.0, rate_hz), "no more images than are looked at")
    needs["perception"] = needs.get("perception", 0.0) * rate_hz / declared_hz


def _shares(
    draft: _Draft,
    observed: Observation,
    needs: Mapping[str, float],
    computer: Computer,
    margin: float,
    mode: TuningMode,
) -> Iterator[tuple[float, str]]:
    rate = observed.rates.get("perception_rate_hz")
    if rate is not None and not rate.kept:
        share = rate.reached_hz / rate.declared_hz * (1.0 - margin)
        yield share, f"reached {rate.reached_hz:.3g} Hz of {rate.declared_hz:g} Hz"
    free, need = computer.cpu_count * (1.0 - margin), sum(needs.values())
    seen = needs.get("perception", 0.0)
    if need > free and seen > 0.0:
        over = f"all processes need {need:.2f} cores of the {free:.2f} that the margin leaves"
        yield max(0.0, 1.0 - (need - free) / seen), over
    limit_c = draft.get("budgets.total.temperature_c")
    hottest_c = observed.hottest_c
    if limit_c and hottest_c is not None and hottest_c > limit_c - _HOT_WITHIN_C:
        yield _COOLER, f"{hottest_c:.0f} degC, the limit is {limit_c:g} degC"
    if mode in (TuningMode.LOW_POWER, TuningMode.EFFICIENT_VISION):
        yield _HALF, f"{mode}: half as many images"


def _budgets(
    draft: _Draft,
    observed: Observation,
    needs: Mapping[str, float],
    computer: Computer,
    margin: float,
) -> None:
    """Raise what was nearly used up; take what the computer lacks from what nobody needed."""
    memories = {name: need.memory_mb for name, need in observed.processes.items()}
    for key, used, there, least in (
        ("cpu_ratio", needs, float(computer.cpu_count), _LEAST_CPU),
        ("memory_mb", memories, computer.memory_mb, _LEAST_MB),
    ):
        names = [name for name in draft.values["budgets"] if name not in ("total", STAND_IN)]
        # A budget wants the whole margin above what was used, and has at least half of it.
        needed = {name: max(least, used.get(name, 0.0) * (1.0 + margin / 2)) for name in names}
        spare = there - sum(needed.values())
        if spare < 0.0:
            raise ProfileDoesNotFit(
                f"budgets.{key}: the processes need {there - spare:.4g} with {margin / 2:.0%} to "
                f"spare, this computer has {there:.4g}; try --mode {TuningMode.LOW_MEMORY}, a "
                "smaller model or a smaller --margin"
            )
        allowed = {
            name: max(
                least, used.get(name, 0.0) * (1.0 + margin), draft.get(f"budgets.{name}.{key}")
            )
            for name in names
        }
        asked = sum(allowed.values()) - sum(needed.values())
        share = min(1.0, spare / asked) if asked else 1.0
        for name in names:
            value = needed[name] + share * (allowed[name] - needed[name])
            digits = 2 if key == "cpu_ratio" else 0
            why = f"used {used[name]:.{digits}f}" if name in used else "did not run"
            why += "" if share == 1.0 else "; all budgets together were more than there is"
            draft.set(f"budgets.{name}.{key}", _rounded(value, digits), why)
        total = sum(draft.get(f"budgets.{name}.{key}") for name in names)
        if share < 1.0:
            draft.set(f"budgets.total.{key}", _rounded(there, 0), "all there is")
        elif total > draft.get(f"budgets.total.{key}"):
            draft.set(f"budgets.total.{key}", math.ceil(total), "the sum of all")


def _rounded(value: float, digits: int) -> float:
    """Return a value that is not above it, as a person would write it."""
    step = 10.0**digits
    whole = math.floor(round(value * step, 6)) / step
    return int(whole) if digits == 0 else whole


def profile_text(parent: str, choices: Sequence[TunedValue], heading: Sequence[str]) -> str:
    """Return a profile file that inherits from `parent`, with the reason for each value."""
    lines = [*(f"# {line}" for line in heading), f"inherits = {toml_value(parent)}"]
    for choice in choices:
        was = "new" if choice.before is None else f"was {toml_value(choice.before)}"
        lines += [f"# {was}: {choice.why}", f"{choice.key} = {toml_value(choice.after)}"]
    return "\n".join(lines) + "\n"
