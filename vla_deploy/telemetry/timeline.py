"""List what control, safety rules, processes and operators did in a flight, and when."""

import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from drivers.clock import NS_PER_S
from vla_deploy.telemetry.channels import TICKS
from vla_deploy.telemetry.recorded_file import RecordedFile, RecordedMessage

Document = Mapping[str, Any]
Line = dict[str, Any]


def time_line(flight: RecordedFile) -> list[Line]:
    """Return the lines by time; 0 s is the first cause.

    Raises:
        FlightUnreadable: the file is cut off or spoiled.
    """
    zero_ns = flight.causes[0]["at_ns"] if flight.causes else flight.end_ns
    lines = [_line(zero_ns, one["at_ns"], "recorder", _cause(one)) for one in flight.causes]
    before: dict[str, list[str]] = {}
    for message in flight.messages(*_SOURCES):
        for who, text in _new_texts(message, before):
            lines.append(_line(zero_ns, message.stamp_ns, who, text))
    return sorted(lines, key=lambda line: line["at_s"])


def _line(zero_ns: int, at_ns: int, who: str, text: str) -> Line:
    return {"at_s": (at_ns - zero_ns) / NS_PER_S, "who": who, "text": text}


def _cause(cause: Document) -> str:
    return f"{cause['kind']}: {cause['what']}" + (
        f" ({cause['detail']})" if cause["detail"] else ""
    )


def _new_texts(message: RecordedMessage, before: dict[str, list[str]]) -> Iterator[tuple[str, str]]:
    """Yield what a message says that the one before it in its topic did not say."""
    who, texts_of, is_state = _SOURCES[message.channel]
    texts = [text for text in texts_of(message.document()) if text]
    known = before.get(message.channel, []) if is_state else []
    before[message.channel] = texts
    yield from ((who, text) for text in texts if text not in known)


def _control(status: Document) -> list[str]:
    why = ": ".join(word for word in (status["cause"], status["detail"]) if word)
    return [status["state"] + (f" ({why})" if why else "")]


def _processes(table: Document) -> list[str]:
    return [
        f"{row['name']}: {row['state']}" + (f" ({row['reason']})" if row["reason"] else "")
        for row in table["processes"]
    ]


def _judge(tick: Document) -> list[str]:
    if "cause" not in tick:
        return []
    return [f"{tick['reaction']} for {tick['cause']}"]


def _operator(act: Document) -> list[str]:
    reason = f": {act['reason']}" if act.get("reason") else ""
    return [f"{act.get('act')} by {act.get('source')}{reason}"]


def _task(event: Document) -> list[str]:
    shown = {name: value for name, value in event.items() if name not in ("plan", "actions")}
    return [json.dumps(shown)]


# By topic: the source's name, its texts, and whether only texts that are new are listed.
_SOURCES: Mapping[str, tuple[str, Callable[[Document], list[str]], bool]] = {
    "control_status": ("control", _control, True),
    "process_table": ("supervisor", _processes, True),
    TICKS: ("judge", _judge, True),
    "operator": ("operator", _operator, False),
    "task_event": ("task", _task, False),
}
