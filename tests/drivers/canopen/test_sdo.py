"""Our SDO client against the vendor-neutral library's server, and against broken replies."""

from typing import Any

import canopen
import pytest
from canopen.objectdictionary import ODVariable, datatypes

from drivers.canopen.sdo import MAX_OBJECT_BYTES, SdoAborted, SdoClient
from drivers.canopen.sdo_words import describe_sdo_reply, describe_sdo_request
from drivers.errors import NoReply, ProtocolError
from sim_twin.contracts.scripted import ManualClock

NODE_ID = 9
INDEX = 0x2001


class LibraryServer:
    """Run canopen's own SDO server for one object of any length."""

    def __init__(self) -> None:
        od = canopen.ObjectDictionary()
        variable = ODVariable("text", INDEX)
        variable.data_type = datatypes.DOMAIN
        od.add_object(variable)
        self.frames: list[bytes] = []
        self.node = canopen.LocalNode(NODE_ID, od)
        self.node.sdo.network = self
        self.answer: Any = None

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        self.frames.append(bytes(data))
        self.answer(bytes(data), 0)

    def take(self, can_id: int, data: bytes) -> None:
        self.frames.append(data)
        self.node.sdo.on_request(can_id, bytearray(data), 0.0)

    @property
    def value(self) -> bytes:
        return bytes(self.node.get_data(INDEX, 0))


@pytest.fixture
def server() -> LibraryServer:
    return LibraryServer()


def client_of(server: LibraryServer) -> SdoClient:
    client = SdoClient(server.take, NODE_ID, "drive left (node 9)", ManualClock())
    server.answer = client.take_reply
    return client


def result(steps: Any) -> Any:
    try:
        while True:
            next(steps)
    except StopIteration as end:
        return end.value


@pytest.mark.parametrize("size", [1, 2, 3, 4, 5, 7, 8, 14, 15, 100, 1000])
def test_any_length_is_written_and_read_back(server: LibraryServer, size: int) -> None:
    data = bytes(number % 251 for number in range(size))
    client = client_of(server)
    result(client.download(INDEX, 0, data))
    assert server.value == data
    assert result(client.upload(INDEX, 0)) == data
    for frame in server.frames:
        assert describe_sdo_request(frame)
        assert describe_sdo_reply(frame)


def test_a_refusal_names_object_code_and_reason(server: LibraryServer) -> None:
    with pytest.raises(SdoAborted, match=r"0x3000:0: refused with 0x06020000, object does not"):
        result(client_of(server).upload(0x3000, 0))


def answering(*replies: bytes) -> tuple[SdoClient, list[bytes]]:
    waiting, sent = list(replies), []

    def send(can_id: int, data: bytes) -> None:
        sent.append(data)
        if waiting and data[0] & 0xE0 != 0x80:
            client.take_reply(waiting.pop(0), 0)

    clock = ManualClock()
    client = SdoClient(send, NODE_ID, "node 9", clock)
    return client, sent


def test_silence_ends_after_the_time_limit_with_an_abort() -> None:
    client, sent = answering()
    steps = client.upload(INDEX, 0)
    next(steps)
    client._clock.sleep_until(10**9)
    with pytest.raises(NoReply, match="no reply in 300 ms; check its power"):
        next(steps)
    assert sent[-1][0] == 0x80


def test_a_late_reply_about_another_object_is_passed_over() -> None:
    client, _ = answering(bytes.fromhex("4f02200001000000"))
    steps = client.upload(INDEX, 0)
    next(steps)
    assert client.replies_refused == 1
    client.take_reply(bytes.fromhex("4f01200007000000"), 0)
    assert result(steps) == b"\x07"


@pytest.mark.parametrize(
    ("replies", "message"),
    [
        (["6001200000000000"], "is no upload response"),
        (["410120000a000000", "1000000000000000"], "out of order"),
        (["4101200003000000", "0101020304050607"], "7 bytes came, 3 were announced"),
    ],
)
def test_a_reply_that_breaks_the_protocol_is_refused_with_an_abort(
    replies: list[str], message: str
) -> None:
    client, sent = answering(*map(bytes.fromhex, replies))
    with pytest.raises(ProtocolError, match=message):
        result(client.upload(INDEX, 0))
    assert sent[-1][0] == 0x80


def test_an_endless_upload_is_ended() -> None:
    segments = [bytes((0x10 * (number % 2), *range(7))) for number in range(MAX_OBJECT_BYTES)]
    client, sent = answering(bytes.fromhex("4001200000000000"), *segments)
    with pytest.raises(ProtocolError, match="longer than"):
        result(client.upload(INDEX, 0))
    assert sent[-1][0] == 0x80


def test_a_short_reply_is_refused() -> None:
    client, _ = answering()
    with pytest.raises(ProtocolError, match="3 bytes, expected 8"):
        client.take_reply(b"abc", 0)
