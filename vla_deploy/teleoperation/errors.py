"""Say why an arm is not moved by hand, or no longer.

TeleoperationError
├── LeaderUnusable      nothing has moved: mend the leader or its calibration
├── InputUnusable       nothing has moved: keyboard or gamepad cannot be read
└── HandMotionEnded     the robot comes to rest where it is: the message says why
"""


class TeleoperationError(Exception):
    """Base of what moving by hand raises."""


class LeaderUnusable(TeleoperationError):
    """Say what is wrong with a leader before anything moves."""


class InputUnusable(TeleoperationError):
    """Say why keys or a gamepad cannot be read."""


class HandMotionEnded(TeleoperationError):
    """Say why the robot is no longer moved by hand."""
