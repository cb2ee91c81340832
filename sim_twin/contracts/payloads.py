"""Hold the messages of a run to the payload types of `vla_deploy/ipc/topics.py`."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from types import UnionType
from typing import (
    Annotated,
    Any,
    Literal,
    Union,
    get_args,
    get_origin,
    get_type_hints,
    is_typeddict,
)

from vla_deploy.ipc import TOPICS, SharedSpace, TopicKind


def payload_faults(space: SharedSpace) -> dict[str, list[str]]:
    """Return for each topic with a payload that was written what is wrong with its messages."""
    found = {}
    for topic in TOPICS:
        payload: Any = topic.payload
        if payload is None:
            continue
        if topic.kind is TopicKind.RING:
            ring = space.ring_reader(topic, from_start=True)
            told = [event.payload for event in ring.drain()]
        else:
            sample = space.cell_reader(topic).latest()
            told = [] if sample is None else [sample.document()]
        if told:
            found[topic.name] = [
                fault for one in told for fault in faults_of(one, payload, topic.name)
            ]
    return found


def faults_of(value: object, expected: Any, where: str) -> Iterator[str]:
    """Yield what of a value, as JSON has it, is not of its type: keys too, missing or unknown."""
    origin, args = get_origin(expected), get_args(expected)
    if expected in (Any, object):
        return
    if origin is Annotated:
        yield from faults_of(value, args[1], where)
    elif origin in (Union, UnionType):
        yield from min((list(faults_of(value, one, where)) for one in args), key=len)
    elif is_typeddict(expected):
        hints = get_type_hints(expected)
        yield from _keys(value, hints, expected.__required_keys__, where)
    elif dataclasses.is_dataclass(expected):
        hints = get_type_hints(expected)
        yield from _keys(value, hints, hints.keys(), where)
    elif origin in (list, tuple, Sequence) and isinstance(value, list):
        for place, one in enumerate(value):
            yield from faults_of(one, args[0], f"{where}[{place}]")
    elif origin in (dict, Mapping) and isinstance(value, dict):
        for key, one in value.items():
            yield from faults_of(one, args[1], f"{where}.{key}")
    elif not _fits(value, expected):
        yield f"{where}: expected {expected}, got {value!r:.80}"


def _keys(
    value: object, hints: Mapping[str, Any], required: frozenset[str] | Any, where: str
) -> Iterator[str]:
    if not isinstance(value, dict):
        yield f"{where}: expected an object, got {value!r:.80}"
        return
    for key in sorted(value.keys() ^ required):
        if key in required or key not in hints:
            yield f"{where}.{key}: {'missing' if key in required else 'unknown'}"
    for key in sorted(value.keys() & hints.keys()):
        yield from faults_of(value[key], hints[key], f"{where}.{key}")


def _fits(value: object, expected: Any) -> bool:
    if get_origin(expected) is Literal:
        return any(value == one and type(value) is type(one) for one in get_args(expected))
    if not isinstance(expected, type):
        return False
    if issubclass(expected, Enum):
        return value in [one.value for one in expected]
    if isinstance(value, bool) or expected is bool:
        return expected is bool and isinstance(value, bool)
    return isinstance(value, (int, float) if expected is float else expected)
