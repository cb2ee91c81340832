"""Drive emulated servos by LeRobot's own buses: `session.py feetech|dynamixel ARM_PORT NEW_PORT`.

It runs in LeRobot's environment, not in ours, and imports nothing of ours. What it cannot do by
the wire it asks for by a line on stdout, such as `overload 3`, and waits for a line on stdin.
NEW_PORT has one new servo, as delivered.
"""

import sys
import time

from lerobot.motors import Motor, MotorCalibration, MotorNormMode
from lerobot.motors.dynamixel import DynamixelMotorsBus
from lerobot.motors.feetech import FeetechMotorsBus

JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")
KOCH = ("xl430-w250", "xl430-w250", "xl330-m288", "xl330-m288", "xl330-m288", "xl330-m288")
BUSES = {"feetech": FeetechMotorsBus, "dynamixel": DynamixelMotorsBus}
MODELS = {"feetech": ("sts3215",) * 6, "dynamixel": KOCH}
MODES = {FeetechMotorsBus: 0, DynamixelMotorsBus: 3}  # position
NUMBERS = {"sts3215": 777, "xl430-w250": 1060, "xl330-m288": 1200}


def motors(family):
    rows = enumerate(zip(JOINTS, MODELS[family], strict=True), 1)
    return {name: Motor(n, model, MotorNormMode.DEGREES) for n, (name, model) in rows}


def have(what):
    print(what, flush=True)
    assert sys.stdin.readline().strip() == "done"


def until(holds, what, seconds=5.0):
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, f"not within {seconds} s: {what}"
        time.sleep(0.02)


def set_up_new(family, port):
    name = JOINTS[-1]
    bus = BUSES[family](port, {name: motors(family)[name]})
    bus.setup_motor(name)
    assert bus.ping(name) == NUMBERS[MODELS[family][-1]]
    bus.disconnect()


def scan(family, port):
    BUSES[family].available_baudrates = [115_200, 1_000_000]  # each takes a second
    found = BUSES[family].scan_port(port)
    assert found == {1_000_000: [1, 2, 3, 4, 5, 6]}, found


def calibrate(bus):
    bus.disable_torque()
    bus.configure_motors()
    assert {bus.read("Return_Delay_Time", n, normalize=False) for n in JOINTS} == {0}
    for name in JOINTS:
        bus.write("Operating_Mode", name, MODES[type(bus)])
    offsets = bus.set_half_turn_homings()
    middle = bus.sync_read("Present_Position", normalize=False)
    assert all(abs(one - 2047) <= 1 for one in middle.values()), middle
    made = {
        name: MotorCalibration(
            id=n, drive_mode=0, homing_offset=int(offsets[name]), range_min=800, range_max=3300
        )
        for n, name in enumerate(JOINTS, 1)
    }
    bus.write_calibration(made)
    assert bus.is_calibrated, bus.read_calibration()


def move(bus):
    goals = dict(zip(JOINTS, (10.0, -20.0, 30.0, -10.0, 5.0, 0.0), strict=True))
    for name, present in bus.sync_read("Present_Position").items():
        bus.write("Goal_Position", name, present)
    bus.enable_torque()
    bus.sync_write("Goal_Position", goals)

    def there():
        shown = bus.sync_read("Present_Position", num_retry=2)
        return all(abs(shown[name] - goal) < 2.0 for name, goal in goals.items())

    until(there, "all joints at their goals")
    assert set(bus.sync_read("Torque_Enable", normalize=False).values()) == {1}


def overload(bus, family):
    name, motor_id = JOINTS[2], 3
    status = "Status" if family == "feetech" else "Hardware_Error_Status"
    bus.write("Goal_Position", name, 0.0)
    have(f"overload {motor_id}")
    if family == "feetech":

        def reported():  # the error byte of any answer makes LeRobot's read fail
            try:
                bus.read(status, name, normalize=False)
            except RuntimeError as error:
                return "verload" in str(error)
            return False

    else:

        def reported():
            try:
                return bus.read(status, name, normalize=False) & 32
            except RuntimeError:  # the alert bit
                return bus.sync_read(status, [name], normalize=False)[name] & 32

    until(reported, "the overload is reported")
    others = bus.sync_read("Present_Position", num_retry=2)
    assert len(others) == 6
    have(f"relieve {motor_id}")
    if family == "dynamixel":
        bus.packet_handler.reboot(bus.port_handler, motor_id)
    else:
        have("power")  # LeRobot has no reboot of FEETECH servos: their power is cut
    until(lambda: bus.ping(name) is not None, "it answers again")
    assert bus.read("Torque_Enable", name, normalize=False) == 0
    assert bus.read(status, name, normalize=False) == 0


def main(family, port, new_port):
    set_up_new(family, new_port)
    scan(family, port)
    bus = BUSES[family](port, motors(family))
    bus.connect()
    calibrate(bus)
    move(bus)
    overload(bus, family)
    assert bus.is_calibrated, "the calibration outlives a restart"
    bus.disconnect()
    print("all done", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
