"""Move parts from a command that a person watches: claimed, until stopped by anybody."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final

from vla_deploy.cli.errors import CommandFailed
from vla_deploy.cli.session import RobotSession
from vla_deploy.client.motions import Claimed, Motions
from vla_deploy.client.readiness import SILENT, refusal_of
from vla_deploy.ipc import RingReader, topics
from vla_deploy.ipc.payloads.tasks import PlanMessage
from vla_deploy.robots import RobotDescription

_FRESH_S: Final = 1.0


class AttendedMotion:
    """Hold a command's motions while the parts that they move are claimed."""

    def __init__(
        self, session: RobotSession, motions: Motions, orders: RingReader[PlanMessage]
    ) -> None:
        self.motions = motions
        self._session = session
        self._orders = orders

    def require_wanted(self) -> None:
        """Check that nobody has asked to stop, and that control answers.

        Raises:
            CommandFailed: somebody has, or it does not.
        """
        # "Stop" in any words or from any place reaches the executor so; it holds for this, too.
        stops = [
            "cancel" in one.payload and "of" not in one.payload for one in self._orders.drain()
        ]
        if any(stops):
            raise CommandFailed("stopped on request; the robot comes to rest where it is")
        if self._session.document(topics.CONTROL_STATUS, _FRESH_S) is None:
            raise CommandFailed(SILENT)


@contextmanager
def attended_motion(
    session: RobotSession, robot: RobotDescription, holder: str, parts: Sequence[str]
) -> Iterator[AttendedMotion]:
    """Claim groups of joints, or the base, for a `with` block, and end its motions with it.

    Raises:
        CommandFailed: the robot is not armed, or something else moves these parts.
    """
    claim = Claimed(session, holder, parts)
    refusal = refusal_of(session.document(topics.CONTROL_STATUS, _FRESH_S)) or claim.why_not_taken()
    if refusal:
        raise CommandFailed(refusal)
    motions = Motions(session, robot.joint_index, "cli")
    orders = session.events(topics.PLAN)
    try:
        yield AttendedMotion(session, motions, orders)
    finally:
        motions.close()
        orders.close()
        claim.release()
