import pytest

from drivers.dynamixel.wire.codec import Instruction, encode_instruction
from drivers.servo.tools.scan import scan_speed

PING_ALL = encode_instruction(254, Instruction.PING)


def test_all_servos_answer_one_question(make_wire, make_specs):
    wire = make_wire(make_specs(1, 7) + make_specs(40, model="XL430-W250"))
    report = scan_speed(wire.open())
    assert [(one.servo_id, one.model_name) for one in report.servos] == [
        (1, "XM430-W350"),
        (7, "XM430-W350"),
        (40, "XL430-W250"),
    ]
    assert not report.clashes
    assert not report.noise_bytes
    assert wire.requests[0] == PING_ALL
    assert len(wire.requests) < 30, "silent ids were not asked one by one"


def test_only_the_ids_that_were_named_are_asked(make_wire, make_specs):
    wire = make_wire(make_specs(1, 2, 3))
    report = scan_speed(wire.open(), [2, 9])
    assert [one.servo_id for one in report.servos] == [2]
    assert PING_ALL not in wire.requests


@pytest.mark.parametrize("one_after_another", [False, True])
@pytest.mark.parametrize("ids", [None, range(1, 10)])
def test_servos_that_share_an_id_are_reported_and_the_others_are_still_found(
    make_wire, make_specs, one_after_another, ids
):
    wire = make_wire(make_specs(1, 5), make_specs(5))
    wire.one_after_another = one_after_another
    report = scan_speed(wire.open(), ids)
    assert report.clashes == (5,)
    assert [one.servo_id for one in report.servos] == [1]


def test_a_servo_whose_answer_was_spoiled_once_is_no_clash(make_wire, make_specs):
    wire = make_wire(make_specs(3))
    wire.banks[0].bank.corrupt_next(3)
    report = scan_speed(wire.open(), [3])
    assert [one.servo_id for one in report.servos] == [3]
    assert report.clashes == ()


def test_an_empty_bus_has_nothing(make_wire):
    report = scan_speed(silent_wire(make_wire).open())
    assert (report.servos, report.clashes, report.noise_bytes) == ((), (), 0)


def silent_wire(make_wire):
    wire = make_wire()
    assert wire.banks == []
    return wire


def test_bytes_that_make_no_packet_are_reported_as_noise(make_wire):
    wire = silent_wire(make_wire)
    wire.receive = lambda data: setattr(wire, "extra", b"\x80\xf8\x00")
    report = scan_speed(wire.open())
    assert report.noise_bytes == 3
    assert report.servos == ()


@pytest.mark.parametrize("ids", [(1,), (1, 18)])
def test_a_servo_of_protocol_1_is_recognised(make_wire, ids):
    wire = silent_wire(make_wire)

    def answer(data):
        if data == b"\xff\xff\xfe\x02\x01\xfe":
            for one in ids:
                frame = bytes([one, 2, 0])
                wire.extra += b"\xff\xff" + frame + bytes([~sum(frame) & 0xFF])

    wire.receive = answer
    assert scan_speed(wire.open()).other_family_ids == ids


def test_progress_is_reported_for_every_request(make_wire, make_specs):
    reported = []
    scan_speed(make_wire(make_specs(4)).open(57_600), [3, 4], reported.append)
    assert reported == ["57600 baud: id 3", "57600 baud: id 4"]
