import pytest

from drivers.dynamixel.errors import RejectedAccess
from drivers.dynamixel.wire.codec import Instruction
from drivers.servo.errors import ServoSilent, WrongServo
from drivers.servo.tools.bench import FoundServo, Keep
from drivers.servo.tools.scan import scan_speed
from sim_twin.servos import EmulatedServoSpec


@pytest.fixture
def wire(make_wire, make_specs):
    return make_wire(make_specs(2, 6))


def test_a_servo_reports_its_model_and_is_then_read_by_name(wire):
    link = wire.open()
    servo = link.servo(6)
    assert servo.model_name == "XM430-W350"
    assert link.read(servo, "position_p_gain") == 800
    link.write(servo, "position_p_gain", 900)
    assert link.read(servo, "position_p_gain") == 900


def test_a_silent_id_is_an_error_that_names_id_and_speed(wire):
    with pytest.raises(ServoSilent, match="ping servo 9 at 57600 baud: no answer"):
        wire.open(57_600).ping(9)


def test_a_model_that_is_not_registered_is_refused_with_those_that_are(wire):
    found = FoundServo(servo_id=2, model_number=4321, model_name="unknown model 4321", firmware="1")
    link = wire.open()
    link.ping = lambda servo_id: found
    with pytest.raises(WrongServo, match=r"servo 2: unknown model 4321; .*XL430-W250"):
        link.servo(2)


def test_a_reboot_waits_until_the_servo_is_back(wire):
    link = wire.open()
    servo = link.servo(2)
    link.write(servo, "torque_enable", 1)
    start_ns = wire.now_ns()
    link.reboot(servo)
    assert wire.now_ns() > start_ns
    assert link.read(servo, "torque_enable") == 0


def test_a_servo_that_does_not_come_back_is_an_error(wire):
    link = wire.open()
    link.link.broadcast(Instruction.REBOOT, b"")
    wire.banks[0].bank.silence(2)
    with pytest.raises(ServoSilent, match="ping servo 2"):
        link.await_boot(2)


@pytest.mark.parametrize(
    ("keep", "servo_id", "baud_code"),
    [(Keep.ID_AND_BAUD, 6, 3), (Keep.ID, 6, 1), (Keep.NOTHING, 1, 1)],
)
def test_a_factory_reset_keeps_what_its_option_says(make_wire, keep, servo_id, baud_code):
    eeprom = {"baud_rate": 3, "temperature_limit": 60}
    wire = make_wire([EmulatedServoSpec(id=6, model_name="XM430-W350", eeprom=eeprom)])
    link = wire.open()
    link.factory_reset(link.servo(6), keep)
    link.await_boot(servo_id)
    servo = link.servo(servo_id)
    assert link.read(servo, "baud_rate") == baud_code
    assert link.read(servo, "temperature_limit") == 80


def test_a_factory_reset_with_torque_on_is_refused(wire):
    link = wire.open()
    servo = link.servo(2)
    link.write(servo, "torque_enable", 1)
    with pytest.raises(RejectedAccess, match="factory reset of servo 2"):
        link.factory_reset(servo, Keep.ID)


def test_an_echoing_adapter_is_detected_and_its_echo_removed(wire):
    heard = wire.receive

    def echoing(data):
        wire.echo += data
        heard(data)

    wire.echo = b""
    answers = wire.transmit
    wire.receive = echoing
    wire.transmit = lambda: (wire.__dict__.pop("echo"), setattr(wire, "echo", b""))[0] + answers()
    link = wire.open()
    link.detect_echo()
    assert [one.servo_id for one in scan_speed(link).servos] == [2, 6]
    assert link.read(link.servo(2), "position_p_gain") == 800
