"""`vla-deploy profile`: list, show, detect, validate and use platform profiles."""

import argparse
import json
import sys
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from platforms import Profile, ProfileError, load_profile
from platforms.power_switch import PowerSwitch
from platforms.profile import PROFILES, profile_from, profile_names
from platforms.profile_source import ProfileSource, flat, read_source
from vla_deploy.cli.commands import add_command, add_top_command, emit
from vla_deploy.cli.errors import CommandFailed
from vla_deploy.cli.maintenance import profile_tuning
from vla_deploy.cli.session import RobotSession, attach, base_of
from vla_deploy.install.files import slice_too_small
from vla_deploy.install.layout import SERVICE_RUNTIME, InstallLayout
from vla_deploy.ipc import topics
from vla_deploy.ipc.payloads.supervision import ConcludedRequest
from vla_deploy.supervisor.profiles.profile_change import ChangeOutcome, ChangePhase
from vla_deploy.supervisor.profiles.profile_choice import choice_of, detect, start_profile
from vla_deploy.supervisor.runs.runtime import running

TIMEOUT_S = 90.0
_BASE = "base"
EXAMPLES = """  vla-deploy profile list
  vla-deploy profile show jetson_orin_nx --diff desktop
  vla-deploy profile detect
  vla-deploy profile validate my_board.toml
  vla-deploy profile tune --out mine.toml       for the robot that runs, on this computer
  vla-deploy profile use jetson_orin_nano_8gb     on the running robot, or for its next start
"""


def register(commands: Any) -> None:
    """Add the command."""
    profile = add_top_command(commands, "profile", EXAMPLES)
    acts = profile.add_subparsers(dest="act", required=True, metavar="ACT")
    added = {
        name: add_command(
            acts, name, summary, f"  vla-deploy profile {example}\n", run, "print JSON"
        )
        for name, summary, example, run in (
            ("list", "list the profiles", "list", list_profiles),
            ("show", "show a profile", "show desktop --provenance", show_profile),
            ("detect", "show which profile fits this computer", "detect", detect_profile),
            ("validate", "check a profile file", "validate my_board.toml", validate_profile),
            (
                "use",
                "take the running robot to a profile, and every later start",
                "use jetson_orin_nano_8gb_super --dry-run",
                use_profile,
            ),
        )
    }
    profile_tuning.register(acts)
    show, use = added["show"], added["use"]
    show.add_argument("name", nargs="?", help="name or path (default: the one for this computer)")
    show.add_argument("--diff", metavar="OTHER", help="show only what differs from another one")
    show.add_argument("--provenance", action="store_true", help="say which file set each value")
    added["validate"].add_argument("path", help="a path that ends in .toml, or a name")
    use.add_argument("name", help="name or path")
    use.add_argument("--dry-run", action="store_true", help="prepare everything, change nothing")
    use.add_argument(
        "--allow-restart",
        action="store_true",
        help="restart a process that cannot change while it runs",
    )


def list_profiles(arguments: argparse.Namespace) -> int:
    """Print every profile, which one fits this computer and which one is chosen."""
    fits, chosen = detect()[0], choice_of(arguments.runtime_base).load()
    rows = [_row(name, fits, chosen) for name in profile_names()]
    lines = [f"{row['name']:<28} {row['note']}".rstrip() for row in rows]
    return emit(arguments, rows, "\n".join(lines))


def _row(name: str, fits: str, chosen: str | None) -> dict[str, Any]:
    source = read_source(name)
    notes = (
        (_is_base(name), "to inherit from"),
        (name == fits, "fits this computer"),
        (name == chosen, "chosen"),
    )
    return {
        "name": name,
        "inherits": source.parents,
        "note": ", ".join(note for holds, note in notes if holds),
    }


def _is_base(name: str) -> bool:
    return name in profile_names() and name.endswith(_BASE)


def show_profile(arguments: argparse.Namespace) -> int:
    """Print a profile's values, or what differs from another one."""
    source = read_source(arguments.name or start_profile(arguments.runtime_base).name)
    profile_from(source)
    values = dict(flat(source.values))
    if arguments.diff:
        other = dict(flat(read_source(arguments.diff).values))
        keys = sorted(key for key in values | other if values.get(key) != other.get(key))
        document: dict[str, Any] = {key: [values.get(key), other.get(key)] for key in keys}
        lines = [
            f"{key}: {_shown(mine)}   not {_shown(its)}" for key, (mine, its) in document.items()
        ]
        return emit(arguments, document, "\n".join(lines) or "no difference")
    document = {key: values[key] for key in sorted(values)}
    lines = [f"{key} = {_shown(value)}" for key, value in document.items()]
    if arguments.provenance:
        document = {
            key: {"value": value, "file": str(source.file_of(key))}
            for key, value in document.items()
        }
        lines = [
            f"{line:<60}  {_file(source, key)}" for line, key in zip(lines, document, strict=True)
        ]
    return emit(arguments, document, "\n".join(lines))


def detect_profile(arguments: argparse.Namespace) -> int:
    """Print which profile fits this computer, and which one a start would take."""
    name, why = detect()
    start = start_profile(arguments.runtime_base)
    document = {
        "profile": name,
        "why": why,
        "next_start": start.name,
        "next_start_why": start.why,
        "fault": start.fault,
    }
    text = f"{name} ({why})" + (
        "" if start.name == name else f"\nthe next start takes {start.name} ({start.why})"
    )
    text += start.fault and f"\n{start.fault}"
    return emit(arguments, document, text)


def validate_profile(arguments: argparse.Namespace) -> int:
    """Print every fault of a profile; exit code 2 when it has some."""
    try:
        profile = load_profile(arguments.path)
    except ProfileError as error:
        if not arguments.json:
            raise
        emit(arguments, {"valid": False, "faults": list(error.faults)}, "")
        return 2
    return emit(arguments, {"valid": True, "faults": []}, f"{profile.name}: valid")


def use_profile(arguments: argparse.Namespace) -> int:
    """Choose a profile; a running robot changes to it at once, or refuses with the reason."""
    name = _absolute(arguments.name)
    if _is_base(name):
        raise CommandFailed(
            f"profile {name}: made to be inherited, for no computer; `vla-deploy profile list` "
            f"tells which fits this one"
        )
    _warn_of_small_slice(arguments, load_profile(name))
    if running(base_of(arguments)) is None:
        return _choose(arguments, name)
    session = attach(arguments.runtime_base)
    try:
        outcome = _request(session, name, arguments)
    finally:
        session.close()
    if outcome["outcome"] not in (ChangeOutcome.KEPT, ChangeOutcome.WOULD_WORK):
        emit(arguments, outcome, "")
        raise CommandFailed(f"profile {name} {outcome['outcome']}: {outcome['reason']}")
    note = f" {outcome['reason']}" if outcome["reason"] else ""
    return emit(arguments, outcome, f"profile {name}: {outcome['outcome']}{note}")


def _warn_of_small_slice(arguments: argparse.Namespace, profile: Profile) -> None:
    """Warn where the service's control group was sized for a smaller profile."""
    is_service = base_of(arguments) == SERVICE_RUNTIME
    warning = slice_too_small(profile, InstallLayout()) if is_service else ""
    if warning:
        sys.stderr.write(f"vla-deploy: {warning}\n")


def _choose(arguments: argparse.Namespace, name: str) -> int:
    """Store the choice for the next start."""
    PowerSwitch().check(load_profile(name).power_mode)
    if not arguments.dry_run:
        choice_of(arguments.runtime_base).save(name)
    outcome = ChangeOutcome.WOULD_WORK if arguments.dry_run else ChangeOutcome.KEPT
    document = {"profile": name, "outcome": outcome.value, "reason": "no robot runs"}
    return emit(arguments, document, f"profile {name}: {outcome} for the next start; no robot runs")


def _request(session: RobotSession, name: str, arguments: argparse.Namespace) -> ConcludedRequest:
    """Send the request to the supervisor and wait for its outcome.

    Raises:
        CommandFailed: the supervisor does not report one.
    """
    request_id = uuid.uuid4().hex
    session.writer(topics.PROFILE_REQUEST).publish(
        {
            "request_id": request_id,
            "profile": name,
            "allow_restart": arguments.allow_restart,
            "dry_run": arguments.dry_run,
        }
    )
    phases = [""]

    def look() -> ConcludedRequest | None:
        status = session.document(topics.PROFILE_STATUS, age_limit_s=3.0)
        if status is None:
            return None
        if status["last"].get("request_id") == request_id:
            return status["last"]
        phase = status["phase"]
        if phase not in ("", phases[-1]) and not arguments.json:
            print(_PHASE_WORDS[phase], flush=True)
            phases.append(phase)
        return None

    outcome = session.wait_for(look, TIMEOUT_S)
    if outcome is None:
        raise CommandFailed(f"the supervisor tells nothing of profile {name}: vla-deploy status")
    return outcome


_PHASE_WORDS: Final[Mapping[str, str]] = {
    ChangePhase.PREPARE: "every process prepares",
    ChangePhase.SET_POWER: "setting the power mode",
    ChangePhase.COMMIT: "switching over",
    ChangePhase.WATCH: "watching rates, late ticks and memory",
    ChangePhase.VALIDATE: "judging",
    ChangePhase.ROLLBACK: "going back",
}


def _absolute(name: str) -> str:
    """Return a name that is valid in every working directory."""
    return str(Path(name).resolve()) if name.endswith(".toml") else name


def _file(source: ProfileSource, key: str) -> str:
    path = source.file_of(key)
    return path.name if path.is_relative_to(PROFILES) else str(path)


def _shown(value: object) -> str:
    return "nothing" if value is None else json.dumps(value)
