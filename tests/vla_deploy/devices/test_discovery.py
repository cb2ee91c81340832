"""Discovery documents: those of real devices are read, and nothing in any is taken as it comes."""

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.devices import StateUnreadable
from vla_deploy.devices.discovery import read_discovery

# As Tasmota with SetOption19, zigbee2mqtt (a light, a plug) and ESPHome publish them, shortened.
TASMOTA = {
    "name": "Plug",
    "~": "tasmota_1/",
    "cmd_t": "~cmnd/POWER",
    "stat_t": "~tele/STATE",
    "val_tpl": "{{value_json.POWER}}",
    "pl_off": "OFF",
    "pl_on": "ON",
    "avty_t": "~tele/LWT",
    "pl_avail": "Online",
    "pl_not_avail": "Offline",
}
ZIGBEE_LIGHT = {
    "availability": [
        {"topic": "zigbee2mqtt/bridge/state"},
        {"topic": "zigbee2mqtt/l/availability"},
    ],
    "command_topic": "zigbee2mqtt/l/set",
    "state_topic": "zigbee2mqtt/l",
    "schema": "json",
    "name": None,
}
ZIGBEE_PLUG = {
    "command_topic": "zigbee2mqtt/p/set",
    "state_topic": "zigbee2mqtt/p",
    "payload_on": "ON",
    "payload_off": "OFF",
    "value_template": "{{ value_json['state'] }}",
}
PLAIN = {
    "command_topic": "a/set",
    "state_topic": "a/state",
    "name": "A\x1b[31mlamp\u202e " + "x" * 99,
}


@pytest.mark.parametrize(
    ("document", "topics", "payload_on", "said_on"),
    [
        (TASMOTA, ("tasmota_1/cmnd/POWER", "tasmota_1/tele/STATE"), "ON", b'{"POWER":"ON"}'),
        (
            ZIGBEE_LIGHT,
            ("zigbee2mqtt/l/set", "zigbee2mqtt/l"),
            '{"state": "ON"}',
            b'{"state":"ON"}',
        ),
        (ZIGBEE_PLUG, ("zigbee2mqtt/p/set", "zigbee2mqtt/p"), "ON", b'{"state":"ON","power":3}'),
        (PLAIN, ("a/set", "a/state"), "ON", b"ON"),
    ],
    ids=["Tasmota", "zigbee2mqtt light", "zigbee2mqtt plug", "plain"],
)
def test_documents_of_real_devices(
    document: dict[str, Any], topics: tuple[str, str], payload_on: str, said_on: bytes
) -> None:
    read = read_discovery(json.dumps(document).encode())
    assert (read.command_topic, read.state_topic) == topics
    assert read.payload(True) == payload_on
    assert read.words.is_on(said_on)
    assert len(read.availability) == len(
        document.get("availability", document.get("avty_t", [])[:1])
    )
    assert read.called.isprintable()
    assert len(read.called) < 70


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"state_topic": None}, "a device that tells no state cannot be used"),
        ({"command_topic": "a/+/set"}, "expected one topic"),
        ({"command_topic": "#"}, "expected one topic"),
        ({"command_topic": 7}, 'got "7"'),
        ({"state_topic": "a\x00b"}, "expected one topic"),
        ({"state_topic": "x" * 600}, "expected one topic"),
        ({"payload_on": ["ON"]}, "expected a text as payload_on"),
        ({"state_on": ""}, "expected a text as state_on"),
        ({"schema": 3}, "expected a text as schema"),
        ({"value_template": "{{ value_json.a | int }}"}, "give the topics in the robot file"),
        ({"value_template": {}}, "give the topics in the robot file|^$"),
        ({"availability": "here"}, "expected a list of at most 8"),
        ({"availability": [{"topic": "a"}] * 9}, "expected a list of at most 8"),
        ({"availability": ["a"]}, "expected one topic"),
    ],
)
def test_documents_that_are_refused(change: dict[str, Any], why: str) -> None:
    document = {**PLAIN, **change}
    if change == {"value_template": {}}:  # as good as none
        assert read_discovery(json.dumps(document).encode()).words.pointer == ""
        return
    with pytest.raises(StateUnreadable, match=why) as refused:
        read_discovery(json.dumps(document).encode())
    assert str(refused.value).isprintable()
    assert len(str(refused.value)) < 300


@pytest.mark.parametrize(
    "payload", [b"", b"[]", b"null", b"{", b"\xff", b"[" * 60_000, b'{"a":' * 9000, b" " * 70_000]
)
def test_what_is_no_document_is_refused(payload: bytes) -> None:
    with pytest.raises(StateUnreadable):
        read_discovery(payload)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner),
    max_leaves=8,
)


@given(change=st.dictionaries(st.sampled_from([*TASMOTA, *ZIGBEE_LIGHT, *ZIGBEE_PLUG]), JSON))
def test_any_document_is_read_or_refused(change: dict[str, Any]) -> None:
    try:
        read = read_discovery(json.dumps({**PLAIN, **change}).encode())
    except StateUnreadable as error:
        assert str(error).isprintable()
    else:
        assert not set("+#\0") & {*read.command_topic, *read.state_topic}
