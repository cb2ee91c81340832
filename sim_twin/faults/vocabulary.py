"""Name what can fail and how: the one vocabulary of fault injection."""

from enum import Enum


class Fault(Enum):
    """Name how something fails."""

    OFF = "off"
    STUCK = "stuck"
    GARBAGE = "garbage"
    WRONG = "wrong"
    SLOW = "slow"
    DELAYED = "delayed"
    INTERMITTENT = "intermittent"
    UNPLUG = "unplug"
    BROWN_OUT = "brown_out"
    OVERHEAT = "overheat"
    OVERLOAD = "overload"
    ID_CLASH = "id_clash"
    WRONG_BAUD = "wrong_baud"
    ECHO = "echo"
    BUS_OFF = "bus_off"
    ARBITRATION_LOSS = "arbitration_loss"


class Component(Enum):
    """Name what fails; of servos, drives and devices of the home an instance: its name or id."""

    SERVO_BUS = "servo_bus"
    SERVO = "servo"
    CAN_BUS = "can_bus"
    DRIVE = "drive"
    LIDAR = "lidar"
    IMU = "imu"
    CAMERA = "camera"
    ESTOP = "estop"
    MICROPHONE = "microphone"
    SPEAKER = "speaker"
    BATTERY = "battery"
    BROKER = "broker"
    HOME_DEVICE = "home_device"
