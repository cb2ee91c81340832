"""`vla-deploy fault list | inject | clear | run`: make devices of the twin fail.

All requests go to a running twin; a real robot has nothing that could carry them out.
"""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from drivers.clock import NS_PER_S
from vla_deploy.cli.commands import Run, add_command, add_top_command, emit
from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.session import RobotSession, attach
from vla_deploy.cli.twin import ask_twin
from vla_deploy.ipc import topics

_EXAMPLES: Final = """  vla-deploy fault list                     what can fail
  vla-deploy fault inject servo off left_elbow --for 2
  vla-deploy fault inject servo_bus brown_out --set volts_v=4 --for 0.5
  vla-deploy fault inject servo_bus intermittent --of unplug --period 1 --duty 0.1
  vla-deploy fault clear                    end all faults
  vla-deploy fault run servo_off            play a scenario
"""
_MARGIN_S: Final = 1.0
_TIMES: Final = {
    "start": ("start_s", "seconds from now until it begins"),
    "for": ("duration_s", "seconds it lasts (default: until cleared)"),
    "period": ("period_s", "intermittent: seconds from one beginning to the next"),
    "duty": ("duty_ratio", "intermittent: share of each period that it is on"),
    "probability": ("probability", "intermittent: chance of each period to be on as a whole"),
}


def register(commands: Any) -> None:
    """Add the command."""
    fault = add_top_command(commands, "fault", _EXAMPLES)
    actions = fault.add_subparsers(dest="action", required=True, metavar="ACTION")
    _add(actions, "list", "show what can fail, and what does now", run_list, "list --json")
    _add_inject_arguments(
        _add(
            actions,
            "inject",
            "add one fault",
            run_inject,
            "inject servo off left_elbow --for 2",
            "inject servo_bus brown_out --set volts_v=4",
            "inject lidar intermittent --of off --period 1 --probability 0.2 --seed 7",
        )
    )
    clear = _add(actions, "clear", "end one fault, or all", run_clear, "clear", "clear 3")
    clear.add_argument("id", nargs="?", type=int, help="the number that inject gave (default: all)")
    summary = "play a scenario and show how the robot reacts"
    play = _add(actions, "run", summary, run_scenario, "run servo_off", "run ./mine.toml")
    play.add_argument("scenario", help="a TOML file, or the name of one that ships with the twin")


def _add(
    actions: Any, name: str, summary: str, run: Run, *examples: str
) -> argparse.ArgumentParser:
    text = "".join(f"  vla-deploy fault {one}\n" for one in examples)
    return add_command(actions, name, summary, text, run, json_help="print the answer as JSON")


def _add_inject_arguments(inject: argparse.ArgumentParser) -> None:
    inject.add_argument("component", help="see: vla-deploy fault list")
    inject.add_argument("fault", help="a word of the same list")
    inject.add_argument("instance", nargs="?", help="joint or id of a servo or drive")
    inject.add_argument("--of", metavar="FAULT", help="intermittent: the fault that comes and goes")
    for option, (_, meaning) in _TIMES.items():
        inject.add_argument(f"--{option}", type=float, metavar="N", help=meaning)
    inject.add_argument("--seed", type=int, help="of what is drawn at random")
    inject.add_argument(
        "--set", action="append", default=[], metavar="NAME=NUMBER", help="how bad it is"
    )


def run_list(arguments: argparse.Namespace) -> int:
    """Print every supported combination and the faults in force."""
    answer = ask_twin(attach(arguments.runtime_base).run_dir, "fault_list")
    lines = []
    for row in answer["catalogue"]:
        lines.append(" ".join([row["component"], *_instances(row["instances"])]))
        lines += [
            f"  {fault['fault']:17} {fault['summary']}{_parameters(fault['parameters'])}"
            for fault in row["faults"]
        ]
        lines.append("  intermittent      any of these, coming and going (--of)")
    lines.append("scenarios: " + ", ".join(answer["scenarios"]))
    return emit(arguments, answer, "\n".join([*lines, *_pending_lines(answer["pending"])]))


def run_inject(arguments: argparse.Namespace) -> int:
    """Add a fault and print its number."""
    details: dict[str, Any] = {
        name: getattr(arguments, option)
        for option, (name, _) in _TIMES.items()
        if getattr(arguments, option) is not None
    }
    details |= {
        name: getattr(arguments, name)
        for name in ("component", "fault", "instance", "of", "seed")
        if getattr(arguments, name) is not None
    }
    details |= dict(map(_setting, arguments.set))
    answer = ask_twin(attach(arguments.runtime_base).run_dir, "fault_inject", **details)
    injected = answer["injected"]
    return emit(arguments, answer, f"fault {injected['id']}: {injected['fault']}")


def run_clear(arguments: argparse.Namespace) -> int:
    """End one fault, or all."""
    session = attach(arguments.runtime_base)
    answer = ask_twin(session.run_dir, "fault_clear", id=arguments.id)
    return emit(arguments, answer, "\n".join(_pending_lines(answer["pending"])))


def run_scenario(arguments: argparse.Namespace) -> int:
    """Play a scenario and compare control's stop cause with the expected one.

    Raises:
        UsageError: the file cannot be read, or the robot is stopped already.
        CommandFailed: control named another cause than the scenario expects.
    """
    scenario = _scenario(arguments.scenario)
    session = attach(arguments.runtime_base)
    _require_no_cause(session)
    played = ask_twin(session.run_dir, "fault_run", **scenario)
    if not arguments.json:
        print(f"{played['scenario']}: {played['summary']} (robot meanwhile: {played['meanwhile']})")
    seen = _watch(session, played["end_s"] + _MARGIN_S)
    wanted = played["expect"]["cause"]
    result = {**played, "seen": seen, "as_expected": seen["cause"] == wanted}
    text = f"cause {seen['cause']}, state {seen['state']}; expected cause {wanted}"
    emit(arguments, result, text)
    if seen["cause"] != wanted:
        raise CommandFailed(f"{played['scenario']}: {text}")
    return 0


def _scenario(word: str) -> dict[str, str]:
    """Return the request to the twin: the name of a shipped scenario, or a file's text."""
    path = Path(word)
    if not path.is_file() and path.name == word and path.suffix != ".toml":
        return {"name": word}
    try:
        return {"name": path.stem, "text": path.read_text(encoding="utf-8")}
    except OSError as error:
        raise UsageError(
            f"{path}: {error.strerror}; expected a scenario's TOML file, or a name that "
            "`vla-deploy fault list` shows"
        ) from error
    except UnicodeDecodeError as error:
        raise UsageError(f"{path}: got {error}, expected a TOML document in UTF-8") from error


def _require_no_cause(session: RobotSession) -> None:
    """Refuse where control has a cause already, from before the scenario."""
    status = session.document(topics.CONTROL_STATUS, age_limit_s=1.0)
    if status is not None and status["cause"]:
        raise UsageError(
            f"control is {status['state']} already, cause {status['cause']}; end that first: "
            "vla-deploy fault clear, reset, arm"
        )


def _watch(session: RobotSession, duration_s: float) -> dict[str, Any]:
    """Return the first cause that control reports within a time, and its state at the end."""
    start_ns = now_ns = session.clock.now_ns()
    seen: dict[str, Any] = {"cause": "none", "after_s": None, "state": "silent"}
    while now_ns - start_ns < duration_s * NS_PER_S:
        status = session.document(topics.CONTROL_STATUS, age_limit_s=1.0)
        seen["state"] = "silent" if status is None else status["state"]
        if seen["cause"] == "none" and status is not None and status["cause"]:
            seen |= {"cause": status["cause"], "after_s": (now_ns - start_ns) / NS_PER_S}
        session.pause()
        now_ns = session.clock.now_ns()
    return seen


def _setting(word: str) -> tuple[str, float]:
    name, _, number = word.partition("=")
    try:
        return name, float(number)
    except ValueError:
        raise UsageError(f"--set {word}: expected NAME=NUMBER, as in volts_v=4") from None


def _instances(instances: Mapping[str, int]) -> list[str]:
    named = ", ".join(f"{joint} ({number})" for joint, number in instances.items())
    return [f"[{named}]"] if named else []


def _parameters(parameters: list[Mapping[str, Any]]) -> str:
    words = [
        f"{each['name']}={each['default']:g} ({each['range'][0]:g}..{each['range'][1]:g})"
        for each in parameters
    ]
    return f"; {', '.join(words)}" if words else ""


def _pending_lines(pending: list[Mapping[str, Any]]) -> list[str]:
    return [
        f"fault {fault['id']}: {fault['fault']} ({'on' if fault['on'] else 'off now'})"
        for fault in pending
    ] or ["no fault is in force"]
