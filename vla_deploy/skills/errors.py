"""Group skill failures by what the executor may do next.

SkillFailed
├── TryAgain         the world may be kinder a second time: not found, grasp lost, way blocked
├── NotPossible      the same try would fail the same way: out of reach, hands full
│   └── OutOfReach   standing elsewhere may help
└── RobotNotReady    control refuses motion: a person must reset and arm
"""


class SkillFailed(Exception):
    """Say why a skill did not reach its goal."""


class TryAgain(SkillFailed):
    """Say that a second try may succeed."""


class NotPossible(SkillFailed):
    """Say that a second try would fail the same way."""


class OutOfReach(NotPossible):
    """Say that no hand gets there from where the robot stands."""


class RobotNotReady(SkillFailed):
    """Say that control refuses to move."""
