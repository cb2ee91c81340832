"""`vla-deploy servo ...`: find, look at, set up and calibrate servos."""

from typing import Any

from vla_deploy.cli.commands import add_top_command
from vla_deploy.cli.devices import (
    servo_calibrate,
    servo_calibration,
    servo_change,
    servo_monitor,
    servo_scan,
    servo_setup,
)

PARTS = (
    servo_scan,
    servo_monitor,
    servo_setup,
    servo_calibrate,
    servo_calibration,
    servo_change,
)


def register(commands: Any) -> None:
    """Add the group of commands."""
    servo = add_top_command(
        commands,
        "servo",
        "  vla-deploy servo scan --port /dev/ttyUSB0\n  vla-deploy servo monitor --robot butler\n",
    )
    group = servo.add_subparsers(dest="servo_command", required=True, metavar="SERVO_COMMAND")
    for part in PARTS:
        part.register(group)
