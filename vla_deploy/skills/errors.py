"""Group skill failures by what the executor may do next.

SkillFailed
├── TryAgain         the world may be kinder a second time: not found, grasp lost, way blocked
│   ├── EffectMissing    the skill came to its end, and the world does not show what it should
│   └── Touched          an arm that felt its way has met something, and stands before it
├── NotPossible      the same try would fail the same way: out of reach, hands full
│   ├── OutOfReach   standing elsewhere may help
│   └── PreconditionUnmet    the world lacks what the skill needs; another plan may provide it
└── RobotNotReady    control refuses motion: a person must reset and arm
"""


class SkillFailed(Exception):
    """Say why a skill did not reach its goal."""


class TryAgain(SkillFailed):
    """Say that a second try may succeed."""


class EffectMissing(TryAgain):
    """Say what the world shows instead of what the skill should have brought about."""


class Touched(TryAgain):
    """Say what an arm has met on a way that it thought free."""


class NotPossible(SkillFailed):
    """Say that a second try would fail the same way."""


class OutOfReach(NotPossible):
    """Say that no hand gets there from where the robot stands."""


class PreconditionUnmet(NotPossible):
    """Say what does not hold that a skill needs before it begins."""


class RobotNotReady(SkillFailed):
    """Say that control refuses to move."""
