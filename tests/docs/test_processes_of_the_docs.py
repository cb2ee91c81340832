"""The table of what becomes of silent processes is that of the supervisor."""

import re
from pathlib import Path

from vla_deploy.supervisor.table import TABLE

PAGE = Path(__file__).parents[2] / "docs" / "operating.md"
ROW = re.compile(r"^\| (\w+) \| `(\w+)`, (\d+) s \|", re.M)


def test_every_process_is_told_with_its_topic_and_limit() -> None:
    told = {(name, topic, float(s)) for name, topic, s in ROW.findall(PAGE.read_text())}
    watched = {
        (spec.name, one.topic, one.silence_limit_s)
        for spec in TABLE
        for one in spec.watched
        if one.silence_limit_s is not None
    }
    assert told - watched == {("supervisor", "process_table", 3.0)}  # control watches that one
    assert watched - told == set()
