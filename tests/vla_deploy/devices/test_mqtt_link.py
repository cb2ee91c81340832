"""A device on MQTT, on the twin's broker and on a real one: believed is what it says itself."""

import json
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.vla_deploy.devices.conftest import (
    PASSWORD,
    USER,
    WITHIN_S,
    Broker,
    Client,
    Mosquitto,
)
from vla_deploy.devices import DeviceAway, DeviceError, DeviceNotUsable, StateUnreadable, mqtt_link
from vla_deploy.devices.login import DeviceLogin
from vla_deploy.devices.mqtt_link import BrokerAddress, MqttLink
from vla_deploy.robots.home_devices import MqttTopics
from vla_deploy.runtime.secret import Secret

TOPICS = MqttTopics(
    command_topic="cmnd/lamp/POWER",
    state_topic="stat/lamp/POWER",
    availability_topic="tele/lamp/LWT",
    payload_available="Online",
    payload_not_available="Offline",
)
CONFIG = "homeassistant/light/lamp/config"
DOCUMENT = {"~": "home/lamp", "name": "Lamp", "cmd_t": "~/set", "stat_t": "~/state"}
NewLink = Callable[..., MqttLink]


@pytest.fixture
def new_link(broker: Broker, monkeypatch: pytest.MonkeyPatch) -> Iterator[NewLink]:
    """Make links that wait as long as a busy computer may take."""
    monkeypatch.setattr(mqtt_link, "CONNECT_S", WITHIN_S)
    monkeypatch.setattr(mqtt_link, "STATE_S", WITHIN_S)
    monkeypatch.setattr(mqtt_link, "FIRST_STATE_S", WITHIN_S)
    made: list[MqttLink] = []

    def new_link(declared: MqttTopics = TOPICS) -> MqttLink:
        made.append(MqttLink(declared, broker.address))
        return made[-1]

    yield new_link
    for one in made:
        one.close()


@pytest.fixture
def impatient(new_link: NewLink, monkeypatch: pytest.MonkeyPatch) -> None:
    """Wait shortly for what does not come after a command."""
    monkeypatch.setattr(mqtt_link, "STATE_S", 0.4)


@pytest.fixture
def expecting_nothing(new_link: NewLink, monkeypatch: pytest.MonkeyPatch) -> None:
    """Wait shortly for what is not retained."""
    monkeypatch.setattr(mqtt_link, "FIRST_STATE_S", 0.4)


def obedient(client: Client, command: str = TOPICS.command_topic) -> None:
    """Have the client follow its commands as Tasmota does."""
    state = command.replace("cmnd", "stat").replace("/set", "/state")
    client.on_command(command, lambda payload: client._client.publish(state, payload, qos=1))


def test_it_is_switched_and_tells_its_state_also_one_that_another_hand_gave_it(
    client: Client, new_link: NewLink
) -> None:
    client.say(TOPICS.state_topic, "OFF")
    link = new_link()
    assert not link.read().is_on
    obedient(client)
    assert link.switch(True).is_on
    assert link.read().is_on
    client.say(TOPICS.state_topic, "OFF", retain=False)
    assert not link.read().is_on


def test_its_discovery_document_says_how_it_is_switched(client: Client, new_link: NewLink) -> None:
    client.say(CONFIG, json.dumps(DOCUMENT))
    client.say("home/lamp/state", "ON")
    link = new_link(MqttTopics(discovery="lamp"))
    assert link.read().is_on
    assert link.called == "Lamp"
    obedient(client, "home/lamp/set")
    assert not link.switch(False).is_on
    client.say(CONFIG, json.dumps({**DOCUMENT, "~": "elsewhere"}))
    client.say("elsewhere/state", "ON")
    assert link.read().is_on, "the document that came later counts"


@pytest.mark.parametrize(
    ("answers", "is_on"),
    [(["OFF"], False), (["OFF", "ON"], True), (["ON", "OFF"], False), (["on "], True)],
    ids=["stuck", "slow", "flips back", "in its own way"],
)
def test_what_it_says_after_a_command_counts_not_the_command(
    client: Client,
    new_link: NewLink,
    answers: list[str],
    is_on: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if answers[-1] == "OFF":
        monkeypatch.setattr(mqtt_link, "STATE_S", 1.0)
    client.say(TOPICS.state_topic, "OFF")
    link = new_link()
    said = [(TOPICS.state_topic, one) for one in answers]
    client.on_command(
        TOPICS.command_topic, lambda _: [client._client.publish(*one, qos=1) for one in said]
    )
    reading = link.switch(True)
    client.say("the broker", "has passed on what came before this")
    assert (reading.is_on and link.read().is_on) is is_on


@pytest.mark.usefixtures("impatient")
def test_a_silent_device_is_believed_only_where_it_is_surely_there_and_was_so_already(
    client: Client, new_link: NewLink
) -> None:
    client.say(TOPICS.state_topic, "ON")
    with pytest.raises(DeviceAway, match=r"waited 0\.4 s for its state on stat/lamp/POWER"):
        new_link().switch(True)
    client.say(TOPICS.availability_topic, "Online")
    assert new_link().switch(True).note
    with pytest.raises(DeviceAway, match="waited"):
        new_link().switch(False)
    client.say(TOPICS.availability_topic, "Offline")
    with pytest.raises(DeviceAway, match="it is not there, says tele/lamp/LWT"):
        new_link().read()


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize(
    ("payload", "told"),
    [
        (b"\xff\xfe\x00", "expected"),
        (b"ON\x1b[2J" * 9, r'got "ON\[2JON'),
        (b"x" * 70_000, "70000 bytes came"),
        (b'{"POWER": "ON"}', "expected"),
    ],
    ids=["no text", "control characters", "long", "JSON"],
)
def test_a_malformed_state_is_no_state(
    client: Client, new_link: NewLink, payload: bytes, told: str
) -> None:
    client.say(TOPICS.state_topic, payload)
    link = new_link()
    with pytest.raises(StateUnreadable, match=told) as refused:
        link.read()
    assert str(refused.value).isprintable()
    client.on_command(
        TOPICS.command_topic, lambda _: client._client.publish(TOPICS.state_topic, payload, qos=1)
    )
    with pytest.raises(StateUnreadable, match=r"expected|bytes came"):
        link.switch(True)


@pytest.mark.usefixtures("expecting_nothing")
def test_what_has_told_nothing_is_unknown(client: Client, new_link: NewLink) -> None:
    client.say(TOPICS.state_topic, b"")
    link = new_link()
    with pytest.raises(StateUnreadable, match="told no state yet"):
        link.read()
    client.say(TOPICS.state_topic, "OFF", retain=False)
    assert not link.read().is_on


def test_ten_megabytes_end_the_connection_and_nothing_else(
    client: Client, new_link: NewLink
) -> None:
    client.say(CONFIG, b"x" * 10_000_000)
    client.say(TOPICS.state_topic, "ON")
    with pytest.raises(DeviceAway, match="more than 1048576 bytes came at once"):
        new_link(MqttTopics(discovery="lamp")).read()
    assert new_link().read().is_on


@pytest.mark.usefixtures("expecting_nothing")
def test_an_absent_document_is_named_with_where_it_was_looked_for(
    client: Client, new_link: NewLink
) -> None:
    with pytest.raises(DeviceAway, match="homeassistant/switch/none/config or homeassistant/light"):
        new_link(MqttTopics(discovery="none")).read()


def test_a_killed_broker_is_named_and_found_again(
    broker: Broker, client: Client, new_link: NewLink
) -> None:
    client.say(TOPICS.state_topic, "OFF")
    link = new_link()
    link.read()
    killed = threading.Event()
    client.on_command(TOPICS.command_topic, lambda _: (broker.kill(), killed.set()))
    with pytest.raises(
        DeviceAway, match="connection ended waiting for its state on stat/lamp"
    ) as e:
        link.switch(True)
    assert str(broker.address) in str(e.value)
    assert killed.wait(WITHIN_S)
    with pytest.raises(DeviceAway, match="cannot be reached"):
        link.switch(True)
    broker.start()
    again = Client(broker.address)
    again.say(TOPICS.state_topic, "OFF")
    obedient(again)
    assert link.switch(True).is_on
    again.close()


def test_whoever_ends_does_not_wait(client: Client, new_link: NewLink) -> None:
    client.say(TOPICS.state_topic, "ON")
    link = new_link()
    link.read()
    link.interrupt()
    with pytest.raises(DeviceAway, match="the robot ends"):
        link.switch(False)


@pytest.mark.parametrize("password", [PASSWORD, "battery-staple"])
def test_a_broker_wants_user_and_password_which_no_message_has(
    guarded: Mosquitto, password: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mqtt_link, "FIRST_STATE_S", 0.4)
    login = DeviceLogin(user=USER, password=Secret(password))
    link = MqttLink(TOPICS, guarded.address, lambda: login)
    expected: tuple[type[DeviceError], str] = (StateUnreadable, "told no state yet")
    if password != PASSWORD:
        expected = DeviceNotUsable, r"refuses us .*; see credentials in \[mqtt\]"
    with pytest.raises(expected[0], match=expected[1]) as refused:
        link.read()
    assert password not in str(refused.value)
    link.close()


@pytest.mark.parametrize(
    "said",
    [
        b"HTTP/1.1 400 Bad Request\r\n\r\n",
        b"\x20\x02\x00\x00\x30\x04\x00\x01\xffx",
        b"\x20\x02\x00\x00\x30\x01\x00",
        b"\x20\x02\x00\x00\x90\x00",
        b"\x20\x02\x00\x00\x30\xff\xff\xff\x7fx",
        b"\x20\x02\x00\x00\xf0\xff\xff\xff\xff\xff",
    ],
    ids=["HTTP", "a topic that is no text", "cut short", "no consent", "256 MB", "endless length"],
)
def test_a_broker_that_breaks_the_protocol_is_left(
    tmp_path: Path, said: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mqtt_link, "CONNECT_S", 0.5)
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(tmp_path / "mqtt"))
        listener.listen()
        link = MqttLink(TOPICS, BrokerAddress(str(tmp_path / "mqtt")))
        server = threading.Thread(target=lambda: _answer_and_leave(listener, said))
        server.start()
        with pytest.raises(DeviceAway, match=r"connection ended|did not answer") as refused:
            link.read()
        assert str(refused.value).isprintable()
        server.join()


def _answer_and_leave(listener: socket.socket, said: bytes) -> None:
    line, _ = listener.accept()
    with line:
        line.recv(1000)
        line.sendall(said)
        line.recv(1000)


def test_without_its_library_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> Any:
        raise ImportError(name)

    monkeypatch.setattr(mqtt_link, "import_module", missing)
    with pytest.raises(DeviceNotUsable, match="pip install 'paho-mqtt"):
        MqttLink(TOPICS, BrokerAddress("127.0.0.1", 1)).read()
