"""Group skill failures by what the executor may do next.

SkillFailed
├── TryAgain         the world may be kinder a second time: not found, grasp lost, way blocked
│   ├── EffectMissing    the skill came to its end, and the world does not show what it should
│   ├── Touched          an arm that felt its way has met something, and stands before it
│   ├── NotHeld          the fingers have closed, and do not hold what they should
│   ├── NotThere         a thing is not where it was seen
│   └── ServerAborted    a server beyond the robot gave its goal up
├── NotPossible      the same try would fail the same way: out of reach, hands full
│   ├── OutOfReach   standing elsewhere may help
│   ├── PreconditionUnmet    the world lacks what the skill needs; another plan may provide it
│   └── ServerRejected   a server beyond the robot did not take its goal
├── ServerCancelled  somebody else has cancelled a goal with its server
├── ServerLost       nobody knows how a goal ended: its server or the ROS gateway does not answer
└── RobotNotReady    control refuses motion: a person must reset and arm
    └── RefusedAtStart   it did before the action had begun
"""

from typing import ClassVar

from vla_deploy.client.action_status import ActionStatus


class SkillFailed(Exception):
    """Say why a skill did not reach its goal, and how its action ends by that."""

    status: ClassVar[ActionStatus] = ActionStatus.ABORTED


class TryAgain(SkillFailed):
    """Say that a second try may succeed."""


class EffectMissing(TryAgain):
    """Say what the world shows instead of what the skill should have brought about."""


class Touched(TryAgain):
    """Say what an arm has met on a way that it thought free."""


class NotHeld(TryAgain):
    """Say what the fingers feel instead of what they should hold."""


class NotThere(TryAgain):
    """Say what is not where it was seen."""


class ServerAborted(TryAgain):
    """Say why a server beyond the robot gave its goal up."""


class NotPossible(SkillFailed):
    """Say that a second try would fail the same way."""


class OutOfReach(NotPossible):
    """Say that no hand gets there from where the robot stands."""


class PreconditionUnmet(NotPossible):
    """Say what does not hold that a skill needs before it begins."""

    status = ActionStatus.REJECTED


class ServerRejected(NotPossible):
    """Say which server beyond the robot did not take its goal."""

    status = ActionStatus.REJECTED


class ServerCancelled(SkillFailed):
    """Say which server tells that its goal was cancelled, though not by this robot."""

    status = ActionStatus.CANCELLED


class ServerLost(SkillFailed):
    """Say why nobody knows how a goal ended."""

    status = ActionStatus.LOST


class RobotNotReady(SkillFailed):
    """Say that control refuses to move."""


class RefusedAtStart(RobotNotReady):
    """Say why control refuses an action that has not begun."""

    status = ActionStatus.REJECTED
