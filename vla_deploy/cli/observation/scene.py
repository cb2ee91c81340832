"""`vla-deploy scene`: what the robot knows about the things around it."""

import argparse
from collections.abc import Mapping
from typing import Any

from vla_deploy.cli.commands import add_top_command, emit
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.session import RobotSession, attach
from vla_deploy.plans.knowledge import match_place, spoken_places
from vla_deploy.plans.scene_report import scene_report
from vla_deploy.robots import RobotDescription
from vla_deploy.world import Viewpoint

EXAMPLES = """  vla-deploy scene
  vla-deploy scene --of "red cup" --relations
  vla-deploy scene --of cup --on "coffee table"
  vla-deploy scene --why-not reachable
  vla-deploy scene --of keys --look --json
"""


def register(commands: Any) -> None:
    """Add the command."""
    scene = add_top_command(commands, "scene", EXAMPLES, run, json_help="print everything as JSON")
    scene.add_argument("--of", metavar="WORDS", default="", help='such as "small cup", "cup_1"')
    scene.add_argument("--near", metavar="WORDS", help="only what is near this thing or furniture")
    scene.add_argument("--on", metavar="WORDS", help="only what is on this thing or furniture")
    scene.add_argument("--relations", action="store_true", help="how things lie to each other")
    scene.add_argument(
        "--why-not", choices=("reachable",), help="what keeps each thing from being taken"
    )
    scene.add_argument("--look", action="store_true", help="where to look for it, likeliest first")
    scene.add_argument("--from", dest="view", metavar="PLACE", help="as seen from a named place")


def run(arguments: argparse.Namespace) -> int:
    """Print the scene of the run on this machine."""
    report = collect(attach(arguments.runtime_base), arguments)
    return emit(arguments, report, lambda: as_text(report, arguments))


def collect(session: RobotSession, arguments: argparse.Namespace) -> dict[str, Any]:
    """Return the report that the arguments ask for.

    Raises:
        UsageError: perception is silent, or the robot knows no such place.
        UnknownWord: the query has an unknown word.
    """
    document, robot = session.scene(), session.running_robot()
    view = _view(arguments.view, robot)
    return scene_report(document, robot, session.clock.now_ns(), _words(arguments), view)


def _words(arguments: argparse.Namespace) -> str:
    words: str = arguments.of
    for relation in ("near", "on"):
        if getattr(arguments, relation):
            words += f" {relation} {getattr(arguments, relation)}"
    return words


def _view(place: str | None, robot: RobotDescription) -> Viewpoint | None:
    if place is None:
        return None
    name = match_place(place, spoken_places(robot.places))
    if name is None:
        raise UsageError(f'no place "{place}"; known: {", ".join(sorted(robot.places))}')
    pose = robot.places[name].pose
    return Viewpoint(x_m=pose.x_m, y_m=pose.y_m, yaw_rad=pose.yaw_rad, name=name)


def as_text(report: Mapping[str, Any], arguments: argparse.Namespace) -> str:
    """Return the report as lines for a person."""
    lines = _table(report["things"])
    if arguments.relations:
        lines += [
            "",
            *(f"{r['subject']} {r['relation']} {r['other']}" for r in report["relations"]),
        ]
    if arguments.why_not:
        lines += ["", *(line for one in report["things"] for line in _obstacles(one))]
    if arguments.look:
        lines += ["", *map(_guess, report["where_to_look"])]
    lines += [
        f"gone: {one['id']}, last {one['last_place']}: {one['cause']}" for one in report["lost"]
    ]
    held = {hand: what for hand, what in report["hands"].items() if what["class"] or what["cause"]}
    lines += [
        f"{hand} hand: {what['class'] or 'nothing'}, felt {what['felt']}"
        + (f" ({what['cause']})" if what["cause"] else "")
        for hand, what in held.items()
    ]
    return "\n".join(lines)


def _table(things: list[dict[str, Any]]) -> list[str]:
    if not things:
        return ["nothing of that kind is known"]
    rows = [f"{'id':<10} {'what':<14} {'place':<18} {'x':>6} {'y':>6} {'z':>5} {'±mm':>4} "
            f"{'away':>7} {'seen':<15} {'there':>5}  take"]  # fmt: skip
    for one in things:
        x_m, y_m, z_m = one["position_m"]
        away = "" if one["distance_m"] is None else f"{one['distance_m']:.2f} m"
        what = f"{one['colour']} {one['class']}"
        rows.append(
            f"{one['id']:<10} {what:<14} {one['place']:<18} {x_m:6.2f} {y_m:6.2f} {z_m:5.2f} "
            f"{1000 * max(one['sigma_m']):4.0f} {away:>7} {one['seen']:<15} "
            f"{100 * one['still_there']:4.0f}%  {_taken(one['access'])}"
        )
    return rows


def _taken(access: Mapping[str, Any]) -> str:
    if access["accessible"]:
        return str(access["reachable"])
    return "no: " + ", ".join(dict.fromkeys(one["bar"] for one in access["obstacles"]))


def _obstacles(thing: Mapping[str, Any]) -> list[str]:
    obstacles = thing["access"]["obstacles"]
    if not obstacles:
        return [f"{thing['id']}: {thing['access']['reachable']}"]
    return [f"{thing['id']}: {one['bar']}: {one['why']}" for one in obstacles]


def _guess(guess: Mapping[str, Any]) -> str:
    what = f" ({guess['thing_id']})" if guess["thing_id"] else ""
    return f"{100 * guess['probability']:3.0f}% {guess['place']}{what}: {guess['why']}"
