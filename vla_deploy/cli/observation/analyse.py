"""`vla-deploy analyse`: what the scene holds, how things lie, whether a goal can be reached."""

import argparse
from collections.abc import Iterator
from typing import Any, Final

from vla_deploy.analysis.document import AnalysedObject, SceneAnalysis
from vla_deploy.analysis.geometric import GeometricAnalyser
from vla_deploy.analysis.question import Analyser, question_about
from vla_deploy.analysis.served import WITHIN_S, ServedAnalyser
from vla_deploy.cli.commands import add_top_command
from vla_deploy.cli.session import FRESH_S, RobotSession, attach, base_of
from vla_deploy.feasibility.abilities import Abilities
from vla_deploy.feasibility.question import SceneQuestion
from vla_deploy.feasibility.verdict import Task
from vla_deploy.ipc import topics
from vla_deploy.ipc.rgbd_image import colours
from vla_deploy.model_servers.shelf import ServerShelf

EXAMPLES: Final = """  vla-deploy analyse
  vla-deploy analyse --goal "pick up the red cup and put it in the box"
  vla-deploy analyse --server bench --json      ask a model too: vla-deploy servers list
"""


def register(commands: Any) -> None:
    """Add the command."""
    analyse = add_top_command(
        commands, "analyse", EXAMPLES, run, json_help="print the analysis as JSON"
    )
    analyse.add_argument(
        "--goal", default="", metavar="WORDS", help="judge whether this can be done"
    )
    analyse.add_argument("--server", metavar="NAME", help="ask this model server for names too")
    analyse.add_argument(
        "--within",
        type=float,
        default=WITHIN_S,
        metavar="S",
        help=f"how long the server may take, in seconds (default: {WITHIN_S:g})",
    )


def run(arguments: argparse.Namespace) -> int:
    """Print the analysis of what the running robot sees."""
    session = attach(arguments.runtime_base)
    analysis = analyser_for(session, arguments).analyse(ask(session, arguments.goal))
    print(analysis.model_dump_json(indent=2) if arguments.json else as_text(analysis))
    return 0


def ask(session: RobotSession, goal: str) -> SceneQuestion:
    """Return the question about the robot's present scene, image and state.

    Raises:
        UsageError: perception is silent.
    """
    frame = session.frame(topics.RGBD, age_limit_s=FRESH_S)
    image = None if frame is None else colours(frame)
    return question_about(session, session.scene(), goal, image)


def analyser_for(session: RobotSession, arguments: argparse.Namespace) -> Analyser:
    """Return the analyser for the robot that runs, with the model server that is named.

    Raises:
        UsageError: the supervisor is silent.
        ModelServerError: the server is not declared, or its key is missing.
    """
    measuring = GeometricAnalyser(Abilities.of(session.running_robot()))
    if arguments.server is None:
        return measuring
    server = ServerShelf.of_base(base_of(arguments), session.clock).open(arguments.server)
    return ServedAnalyser(server, measuring, arguments.within)


def as_text(analysis: SceneAnalysis) -> str:
    """Return an analysis as lines for a person."""
    lines = [_object_line(one) for one in analysis.objects] or ["nothing is known around"]
    lines += [f"  {one.subject} {one.relation} {one.other}" for one in analysis.relations]
    lines += _task_lines(analysis.task) if analysis.task else []
    lines += [f"note: {note}" for note in analysis.notes]
    return "\n".join(lines)


def _object_line(one: AnalysedObject) -> str:
    where = " ".join(word for word in (one.side, one.distance) if word) or "somewhere"
    hand = "can be taken" if one.graspable and one.accessible else "cannot be taken"
    known = one.id or "not measured"
    return (
        f"{known:<14} {one.size or ''} {one.colour} {one.name}, {where}, {hand}, "
        f"{100 * one.confidence:.0f} % sure ({one.source})"
    )


def _task_lines(task: Task) -> Iterator[str]:
    verdict = task.feasible.replace("_", " ")
    yield f'"{task.goal}": {verdict}, {100 * task.confidence:.0f} % sure: {task.reason}'
    for head, rows in (
        ("before", task.prerequisites),
        ("in the way", task.obstacles),
        ("instead", task.alternatives),
    ):
        yield from (f"  {head}: {row}" for row in rows)
