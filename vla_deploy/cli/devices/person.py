"""`vla-deploy person list | take | put | walk`: be a person in the world of a running twin."""

import argparse
from typing import Any, Final

from vla_deploy.cli.commands import add_command, add_top_command, emit, number_within
from vla_deploy.cli.errors import CommandFailed
from vla_deploy.cli.session import attach
from vla_deploy.cli.twin import ask_twin

_EXAMPLES: Final = """  vla-deploy say "bring me the red cup"      it then asks to be relieved of it
  vla-deploy person take red_cup            in another terminal: pull until it lets go
  vla-deploy person put red_cup 2.2 1.6 0.4975
  vla-deploy person put chair 3.1 2.4 0      a chair in the robot's way
  vla-deploy person walk 4,1 4,3 2,3         appear at 4, 1 and walk; no points: go away
  vla-deploy person list                    what there is, and who has it
"""
_LONGEST_S: Final = 30.0
"""A person gives up sooner, in the twin's time, which may be slower than ours."""
_METRES: Final = number_within(-50.0, 50.0, "metres from -50 to 50")
_RADIANS: Final = number_within(-6.3, 6.3, "radians from -6.3 to 6.3")


_SPEED: Final = number_within(0.05, 3.0, "m/s from 0.05 to 3")


def _point(text: str) -> tuple[float, float]:
    x_text, comma, y_text = text.partition(",")
    if not comma:
        raise argparse.ArgumentTypeError(f'expected a point such as "4.2,1.5", got {text!r}')
    return _METRES(x_text), _METRES(y_text)


def register(commands: Any) -> None:
    """Add the command."""
    person = add_top_command(commands, "person", _EXAMPLES)
    actions = person.add_subparsers(dest="action", required=True, metavar="ACTION")
    as_json = "print the answer as JSON"
    text = "  vla-deploy person list\n"
    add_command(actions, "list", "show the things of the world", text, run_list, as_json)
    text = "  vla-deploy person take red_cup\n"
    summary = "take a thing, also out of the robot's hand"
    take = add_command(actions, "take", summary, text, run_take, as_json)
    put = add_command(
        actions,
        "put",
        "put a thing down",
        "  vla-deploy person put red_cup 2.2 1.6 0.4975\n",
        run_put,
        as_json,
    )
    walk = add_command(
        actions,
        "walk",
        "walk about, seen by the robot",
        "  vla-deploy person walk 4,1 4,3 2,3 --speed 0.7\n  vla-deploy person walk\n",
        run_walk,
        as_json,
    )
    walk.add_argument("way", nargs="*", type=_point, metavar="X,Y", help="metres, in the map")
    walk.add_argument("--speed", type=_SPEED, default=1.0, metavar="N", help="m/s (default: 1)")
    for action in (take, put):
        action.add_argument("thing", help="see: vla-deploy person list")
    for name in ("x_m", "y_m", "z_m"):
        put.add_argument(name, type=_METRES, metavar=name[0].upper(), help="metres, in the map")
    put.add_argument("--yaw", type=_RADIANS, default=0.0, metavar="N", help="radians (default: 0)")


def run_list(arguments: argparse.Namespace) -> int:
    """Print where each thing is."""
    answer = ask_twin(attach(arguments.runtime_base).run_dir, "things")
    held, taken = answer["held_by_robot"], answer["taken"]
    lines = [
        f"{name:16} " + " ".join(f"{one:7.3f}" for one in at) + (" held" if name in held else "")
        for name, at in answer["things"].items()
    ]
    return emit(arguments, answer, "\n".join([*lines, *(f"{name:16} taken" for name in taken)]))


def run_take(arguments: argparse.Namespace) -> int:
    """Take a thing, and wait until the robot has let go of it.

    Raises:
        CommandFailed: it does not.
    """
    session = attach(arguments.runtime_base)
    ask_twin(session.run_dir, "take", object=arguments.thing)

    def over() -> dict[str, Any] | None:
        now = ask_twin(session.run_dir, "things")
        return None if now["pulls_at"] else now

    answer = session.wait_for(over, _LONGEST_S, poll_s=0.1)
    if answer is None or arguments.thing not in answer["taken"]:
        reason = answer["told"] if answer else f"no end of the pull within {_LONGEST_S:g} s"
        raise CommandFailed(reason)
    return emit(arguments, answer, f"took {arguments.thing}")


def run_put(arguments: argparse.Namespace) -> int:
    """Put a thing down where it is told to be."""
    place = {name: getattr(arguments, name) for name in ("x_m", "y_m", "z_m")}
    answer = ask_twin(
        attach(arguments.runtime_base).run_dir,
        "put",
        object=arguments.thing,
        yaw_rad=arguments.yaw,
        **place,
    )
    return emit(arguments, answer, f"put {arguments.thing} down")


def run_walk(arguments: argparse.Namespace) -> int:
    """Appear in the world, walk about in it, or go away."""
    run_dir = attach(arguments.runtime_base).run_dir
    answer = ask_twin(run_dir, "walk", way_m=arguments.way, speed_m_s=arguments.speed)
    at_m = answer["at_m"]
    told = "gone" if at_m is None else f"at {at_m[0]:.2f}, {at_m[1]:.2f} m"
    return emit(arguments, answer, told)
