"""Name what a servo can report of itself, for all families."""

from enum import IntFlag


class HardwareError(IntFlag):
    """Name the errors as bits.

    The first five are where hardware_error_status (70) and shutdown (63) of a Dynamixel have them;
    the other families are translated at their wire.
    """

    INPUT_VOLTAGE = 1 << 0
    OVERHEATING = 1 << 2
    ENCODER = 1 << 3
    ELECTRICAL_SHOCK = 1 << 4
    OVERLOAD = 1 << 5
    OVERCURRENT = 1 << 6
