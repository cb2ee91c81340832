"""Ask a running twin what really happened: `python -m sim_twin.referee --run-dir D truth`.

Ground truth is for tests and for the demo's verdict; nothing on the robot may use it.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sim_twin.errors import RefereeRefusal, TwinError, TwinUnreachable
from vla_deploy.client.unix_rpc import request

REFEREE_SOCKET = "referee"
FILM_SOCKET = "film"
_EXAMPLES = """examples:
  python -m sim_twin.referee --run-dir /run/vla truth
  python -m sim_twin.referee --run-dir /run/vla inside --object red_cup --container box
  python -m sim_twin.referee --run-dir /run/vla film_start --path demo.webm
  python -m sim_twin.referee --run-dir /run/vla caption --text "pick_up: red cup"
"""
_SOCKET_AND_ARGUMENTS: dict[str, tuple[str, tuple[str, ...]]] = {
    "truth": (REFEREE_SOCKET, ()),
    "inside": (REFEREE_SOCKET, ("object", "container")),
    "hazards": (REFEREE_SOCKET, ("begin",)),
    "sound_ear": (REFEREE_SOCKET, ()),
    "sound_play": (REFEREE_SOCKET, ("name",)),
    "sound_said": (REFEREE_SOCKET, ("name",)),
    "film_start": (FILM_SOCKET, ("path",)),
    "film_stop": (FILM_SOCKET, ()),
    "caption": (FILM_SOCKET, ("text",)),
}


def ask(run_dir: Path, op: str, **arguments: Any) -> dict[str, Any]:
    """Ask the twin under `run_dir` and return its answer.

    Raises:
        TwinUnreachable: no twin answers there.
        RefereeRefusal: the twin does not know the operation, or what it was asked about.
    """
    if op not in _SOCKET_AND_ARGUMENTS:
        raise RefereeRefusal(f"no operation {op!r}; there are {', '.join(_SOCKET_AND_ARGUMENTS)}")
    path = run_dir / "dev" / _SOCKET_AND_ARGUMENTS[op][0]
    try:
        answer = request(path, {"op": op, **arguments})
    except OSError as error:
        reason = error.strerror or error
        raise TwinUnreachable(f"{path}: {reason}; expected a running twin, start one") from error
    if not answer.pop("ok"):
        raise RefereeRefusal(answer["error"])
    return answer


class RemoteReferee:
    """Judge a run in other processes by its physics; all raise `TwinUnreachable` without a twin."""

    run_dir: Path

    def truth(self) -> dict[str, Any]:
        """Return what the physics knows."""
        return ask(self.run_dir, "truth")

    def inside(self, name: str, container: str) -> dict[str, Any]:
        """Return whether an object rests in a container."""
        return ask(self.run_dir, "inside", object=name, container=container)

    def begin_watch(self) -> None:
        """Forget the hazards seen so far."""
        ask(self.run_dir, "hazards", begin="yes")

    def hazards(self) -> tuple[str, ...]:
        """Return the hazards since the watch began, in words."""
        return tuple(found["text"] for found in ask(self.run_dir, "hazards", begin="")["hazards"])


def main(argv: Sequence[str] | None = None) -> int:
    """Print one answer as JSON; 2 when the twin is not there or refuses."""
    options = vars(_parser().parse_args(argv))
    op, run_dir = options["op"], options["run_dir"]
    names = _SOCKET_AND_ARGUMENTS[op][1]
    missing = [name for name in names if options[name] is None]
    if missing:
        sys.stderr.write(f"referee: {op} needs --{missing[0]}\n")
        return 2
    try:
        answer = ask(run_dir, op, **{name: options[name] for name in names})
    except TwinError as error:
        sys.stderr.write(f"referee: {error}\n")
        return 2
    sys.stdout.write(json.dumps(answer) + "\n")
    return 0


def _absolute(path: str) -> str:
    """Return a path that holds in the twin's working directory too."""
    return str(Path(path).resolve())


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m sim_twin.referee",
        description="Ask a running twin what really happened.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--run-dir", type=Path, required=True)
    parser.add_argument("op", choices=tuple(_SOCKET_AND_ARGUMENTS))
    parser.add_argument("--path", type=_absolute, help="film to write: .webm, .mp4 or .avi")
    for name in ("object", "container", "text", "begin", "name"):
        parser.add_argument(f"--{name}")
    return parser


if __name__ == "__main__":
    sys.exit(main())
