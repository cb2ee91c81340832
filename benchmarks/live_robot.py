"""Run the robot's real processes on a twin, at a priority that the benchmark chooses."""

from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S
from sim_twin.harness.process_stack import ProcessStack
from vla_deploy.cli.session import RobotSession
from vla_deploy.ipc import topics
from vla_deploy.ipc.payloads.motion import OperatorActName

PROFILE_FILE: Final = "bench.toml"
_ARM_S: Final = 30.0
_LOOKS_PER_TRY: Final = 25
_WAY: Final[Mapping[str, OperatorActName]] = {
    "stopped": "reset",
    "fault": "reset",
    "disarmed": "arm",
}
"""What leads from a state towards being armed; elsewhere control is under way."""


class NotReached(Exception):
    """Say that control does not follow: there is nothing to measure."""


@contextmanager
def live_stack(
    folder: Path, profile: str, *options: str
) -> Iterator[tuple[ProcessStack, RobotSession]]:
    """Give the processes of a robot by the text of a profile, which lies in `PROFILE_FILE`.

    `options` are further words for `vla-deploy run`.

    Raises:
        StackFailed: the processes do not come up.
    """
    (folder / PROFILE_FILE).write_text(profile, encoding="utf-8")
    chosen = ("--wall", "--profile", str(folder / PROFILE_FILE), *options)
    stack = ProcessStack(folder / "run", *chosen)
    try:
        stack.wait_until_ready()
        with closing(RobotSession(stack.run_dir)) as session:
            yield stack, session
    finally:
        stack.close()


@contextmanager
def live_robot(folder: Path, realtime_priority: int) -> Iterator[RobotSession]:
    """Give a session with a desktop's robot whose control has this priority; 0 is none.

    Raises:
        StackFailed: the processes do not come up.
    """
    profile = f'inherits = "desktop"\nrealtime_priority = {realtime_priority}\n'
    with live_stack(folder, profile) as (_, session):
        yield session


def arm(session: RobotSession) -> None:
    """Lead control to where it is armed, from wherever it is: a busy machine may stop the robot.

    Raises:
        NotReached: control stays elsewhere.
    """
    deadline_ns = session.clock.now_ns() + round(_ARM_S * NS_PER_S)
    while (state := _state(session)) != "armed":
        if session.clock.now_ns() > deadline_ns:
            raise NotReached(f"control is not armed after {_ARM_S:g} s, but {state}")
        if state in _WAY:
            session.operate(_WAY[state])
        await_change(session, state)


def ticks_so_far(session: RobotSession) -> tuple[int, int]:
    """Return how many ticks control has had, and how many of them were late.

    Raises:
        NotReached: control is silent.
    """
    status = session.document(topics.CONTROL_STATUS)
    if status is None:
        raise NotReached("control tells no ticks")
    return status["tick"], status["late_ticks"]


def await_change(session: RobotSession, state: str) -> None:
    """Return once control is not in this state any more, or after half a second."""
    for _ in range(_LOOKS_PER_TRY):
        if _state(session) != state:
            return
        session.pause()


def _state(session: RobotSession) -> str:
    status = session.document(topics.CONTROL_STATUS, age_limit_s=0.5)
    return "silent" if status is None else str(status["state"])
