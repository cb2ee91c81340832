"""`vla-deploy profile measure` and `tune`: fit a profile to this computer by what was measured."""

import argparse
import os
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import psutil

from drivers.clock import MonotonicClock
from drivers.twin_clock import TwinClock
from platforms import Profile, load_profile
from platforms.profile import profile_from, profile_names
from platforms.profile_source import ProfileSource, merged, read_source
from vla_deploy.cli.commands import add_command, emit, number_above_zero, number_within
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.session import FRESH_S, RobotSession, attach, base_of
from vla_deploy.inference.errors import InferenceError
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.ipc import topics
from vla_deploy.supervisor.profiles.observation import LOOK_S, Observation, Observer
from vla_deploy.supervisor.profiles.tuning import (
    Computer,
    ModelTime,
    TunedValue,
    TuningMode,
    profile_text,
    tuned,
)

_MEASURE = """  vla-deploy profile measure --minutes 10      while the robot does its work
"""
_TUNE = """  vla-deploy profile tune --out mine.toml      then: vla-deploy profile use ./mine.toml
  vla-deploy profile tune --mode low-memory --out small.toml
"""
_MB = 1_000_000
_ROUNDS = 12
_IDLE_RATIO = 0.2


def register(acts: Any) -> None:
    """Add the two acts to `vla-deploy profile`."""
    measure = add_command(
        acts, "measure", "measure whether the running robot keeps its profile", _MEASURE, measured,
        "print JSON",
    )  # fmt: skip
    tune = add_command(
        acts, "tune", "write a profile that fits this computer, by what is measured", _TUNE,
        tune_profile, "print JSON",
    )  # fmt: skip
    for command, minutes in ((measure, 1.0), (tune, 3.0)):
        command.add_argument(
            "--minutes", type=number_above_zero("minutes"), default=minutes,
            help=f"how long to look (default {minutes:g})",
        )  # fmt: skip
    tune.add_argument("--out", type=Path, required=True, metavar="FILE", help="a new .toml")
    tune.add_argument(
        "--margin", type=number_within(0.0, 0.99, "a share from 0 to 0.99"), default=0.25,
        help="of the computer that stays free (default 0.25)",
    )  # fmt: skip
    tune.add_argument(
        "--mode", type=TuningMode, choices=tuple(TuningMode), default=TuningMode.BALANCED,
        help="what to spare (default: balanced)",
    )  # fmt: skip


def measured(arguments: argparse.Namespace) -> int:
    """Print what the processes need and which rates are kept; exit code 1 where one is not."""
    session = attach(arguments.runtime_base)
    try:
        observed = _observe(arguments, session, load_profile(_profile_of(session)))
    finally:
        session.close()
    emit(arguments, _document(observed), "\n".join(_lines(observed)))
    return 1 if observed.troubles else 0


def tune_profile(arguments: argparse.Namespace) -> int:
    """Write a profile that keeps what it declares on this computer, with a reason for each value.

    Raises:
        CommandFailed: no rates fit this computer, or the file cannot be written.
        UsageError: the file is no new .toml.
    """
    out: Path = arguments.out
    if out.suffix != ".toml" or out.exists() or not out.absolute().parent.is_dir():
        raise UsageError(f"--out {out}: expected a new file that ends in .toml, in a folder")
    session = attach(arguments.runtime_base)
    try:
        source = read_source(_profile_of(session))
        _check_parent(source, out)
        observed = _observe(arguments, session, profile_from(source))
    finally:
        session.close()
    computer = this_computer()
    choices = tuned(
        observed,
        source.values,
        computer,
        margin=arguments.margin,
        mode=arguments.mode,
        detectors=tuple(_detector_times(arguments, profile_from(source))),
    )
    _check(source, choices, out)
    text = profile_text(source.name, choices, _heading(arguments, source, observed, computer))
    try:
        out.write_text(text, encoding="utf-8")
    except OSError as error:
        raise CommandFailed(f"--out {out}: {error.strerror}; choose another folder") from error
    document = {
        "file": str(out),
        "observed": _document(observed),
        "choices": [asdict(choice) for choice in choices],
    }
    changed = [f"{one.key}: {one.before} -> {one.after}   {one.why}" for one in choices]
    use = out if out.is_absolute() else f"./{out}"
    told = [*_lines(observed), "", *(changed or ["nothing to change"]), "", f"wrote {out}; next:"]
    told += [f"  vla-deploy profile use {use}", "  vla-deploy profile measure --minutes 10"]
    return emit(arguments, document, "\n".join(told))


def this_computer() -> Computer:
    """Return the cores and the memory that this process may use."""
    memory_mb = psutil.virtual_memory().total / _MB
    return Computer(cpu_count=len(os.sched_getaffinity(0)), memory_mb=memory_mb)


def _profile_of(session: RobotSession) -> str:
    table = session.document(topics.PROCESS_TABLE, age_limit_s=FRESH_S)
    if table is None:
        raise UsageError("the supervisor does not tell its profile; see: vla-deploy status")
    return table["profile"]


def _observe(arguments: argparse.Namespace, session: RobotSession, profile: Profile) -> Observation:
    on_twin_time = isinstance(session.clock, TwinClock)
    observer = Observer(session, profile, on_twin_time=on_twin_time)
    end_s = arguments.minutes * 60.0
    for _ in range(max(2, round(end_s / LOOK_S))):
        observer.look()
        session.pause(LOOK_S)
    observer.look()
    return observer.observation()


def _check_parent(source: ProfileSource, out: Path) -> None:
    """Refuse where the new file could not name the profile in force as its parent."""
    if (
        source.name not in profile_names()
        and source.path.absolute().parent != out.absolute().parent
    ):
        raise UsageError(
            f"--out {out}: expected a file beside {source.path}, the profile in force, which the "
            "new one inherits from"
        )


def _check(source: ProfileSource, choices: tuple[TunedValue, ...], out: Path) -> None:
    """Refuse what `profile use` would refuse; raises ProfileError with every fault."""
    values = source.values
    for choice in choices:
        nested: Any = choice.after
        for part in reversed(choice.key.split(".")):
            nested = {part: nested}
        values = merged(values, nested)
    profile_from(ProfileSource.of_values(str(out), values))


def _detector_times(arguments: argparse.Namespace, profile: Profile) -> Iterator[ModelTime]:
    """Time the detector's files by each provider that the profile names and this computer has."""
    from vla_deploy.model_tools.detectors.adding import empty_images
    from vla_deploy.model_tools.detectors.benching import bench

    choice = profile.models.get("detector")
    if choice is None:
        return
    shelf = ModelShelf.of_base(base_of(arguments), MonotonicClock())
    for provider in choice.providers:
        try:
            model = shelf.store.load(choice.tiers[0])
            alone = replace(choice, providers=(provider,), cpu_fallback=False)
            figures = bench(shelf, model, alone, [empty_images()["noise"]], _ROUNDS)
        except InferenceError:
            continue  # it does not run here: what does is chosen from
        for row in figures.rows:
            precision = row.variant.value.partition("_")[0]
            yield ModelTime(provider=provider, precision=precision, frame_s=row.frame_median_s)


def _document(observed: Observation) -> dict[str, Any]:
    return {**asdict(observed), "cpu_ratio": observed.cpu_ratio, "troubles": observed.troubles}


def _lines(observed: Observation) -> Iterator[str]:
    yield f"{observed.robot}, {observed.seconds:.0f} s, in motion for {observed.busy_ratio:.0%}"
    for name, need in sorted(observed.processes.items()):
        yield f"  {name:<12} {need.cpu_ratio:5.2f} cores  {need.memory_mb:7.0f} MB"
    yield f"  {'together':<12} {observed.cpu_ratio:5.2f} cores"
    for key, rate in observed.rates.items():
        yield f"  {key:<20} {rate.reached_hz:6.2f} of {rate.declared_hz:g} Hz"
    if observed.late_ratio is None:
        yield "  late ticks are not judged on the twin's time; run it with --wall"
    else:
        yield f"  late ticks {observed.late_ratio:.2%}"
    if observed.hottest_c is not None:
        yield f"  hottest {observed.hottest_c:.0f} degC"
    if observed.busy_ratio < _IDLE_RATIO:
        yield "  it hardly moved: give it its usual work meanwhile"
    yield from (f"  NOT KEPT: {trouble}" for trouble in observed.troubles)


def _heading(
    arguments: argparse.Namespace,
    source: ProfileSource,
    observed: Observation,
    computer: Computer,
) -> tuple[str, ...]:
    return (
        f"{observed.robot} on this computer ({computer.cpu_count} cores, "
        f"{computer.memory_mb:.0f} MB), mode {arguments.mode}, margin {arguments.margin:g}:",
        f"measured under {source.name} for {observed.seconds:.0f} s, in motion for "
        f"{observed.busy_ratio:.0%} of them. Written by `vla-deploy profile tune`.",
    )
