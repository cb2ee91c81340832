"""Group what may keep the robot silent by what one can do about it.

VoiceError
├── EngineMissing      the program that speaks, or the voice asked for, is not here: install it
├── SynthesisFailed    the program ran and gave no sound: its own words are in the message
└── OrderRefused       what was to be said is no order: mend whoever gave it
"""


class VoiceError(Exception):
    """Base of everything that the voice raises."""


class EngineMissing(VoiceError):
    """Say which program or voice is missing, and how to get it."""


class SynthesisFailed(VoiceError):
    """Say why a text did not become sound."""


class OrderRefused(VoiceError):
    """Say what was expected in an order to speak."""
