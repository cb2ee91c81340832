import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from drivers.clock import MonotonicClock
from vla_deploy.cli.errors import CommandFailed
from vla_deploy.cli.observation import budget
from vla_deploy.cli.session import RobotSession
from vla_deploy.ipc import SharedSpace

TOLD = {
    "rows": [
        {
            "process": "perception",
            "metric": "memory_mb",
            "measured": 512.5,
            "limit": 400,
            "at_least": False,
            "state": "over",
            "over": True,
            "since_s": 12.0,
            "reason": "",
        },
        {
            "process": None,
            "metric": "temperature_c",
            "measured": None,
            "limit": 85,
            "at_least": False,
            "state": "missing",
            "over": False,
            "since_s": 1.0,
            "reason": "missing, because no zone can be read",
        },
    ],
    "ladder": {
        "step": 1,
        "taken": [
            {
                "action": "slow",
                "process": "perception",
                "ratio": 0.5,
                "since_s": 3.0,
                "why": "too much",
            }
        ],
        "history": [
            {
                "action": "suspend",
                "process": "planner",
                "ratio": 1.0,
                "taken": False,
                "ago_s": 40.0,
                "why": "relieved",
            }
        ],
        "counts": {"taken": 2, "undone": 1},
    },
    "enforced": [{"process": "perception", "memory": "cgroup: memory.max 1", "cpu": "none"}],
    "hint": "3 peaks",
    "stop": False,
    "reason": "",
}


@pytest.fixture
def session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    session = RobotSession(tmp_path)
    monkeypatch.setattr(budget, "attach", lambda _: session)
    yield session
    session.close()


@pytest.fixture
def told(tmp_path: Path, session: RobotSession):
    space = SharedSpace(tmp_path / "ipc", MonotonicClock())
    space.cell_writer("budget").put_document(TOLD)
    yield
    space.close()


def options(**given: bool) -> SimpleNamespace:
    return SimpleNamespace(**{"json": False, "watch": False, "runtime_base": None, **given})


def test_every_row_ladder_step_and_enforcement_is_shown(told, capsys):
    assert budget.run(options()) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].split() == ["perception", "memory", "MB", "512.5", "<=", "400", "over"]
    assert lines[2].endswith("missing  missing, because no zone can be read")
    assert "unknown" in lines[2]
    assert "  slow perception to 50 %, for 3 s: too much" in lines
    assert "  40 s ago undid suspend planner: relieved" in lines
    assert "  perception   memory: cgroup: memory.max 1" in lines
    assert lines[-1] == "hint: 3 peaks"


def test_json_is_what_the_supervisor_tells(told, capsys):
    budget.run(options(json=True))
    assert json.loads(capsys.readouterr().out) == TOLD


def test_watching_goes_on_until_it_is_interrupted(told, session, monkeypatch, capsys):
    pauses = iter([None, None])

    def pause(_: float) -> None:
        try:
            next(pauses)
        except StopIteration:
            raise KeyboardInterrupt from None

    monkeypatch.setattr(session, "pause", pause)
    with pytest.raises(KeyboardInterrupt):
        budget.run(options(json=True, watch=True))
    assert len(capsys.readouterr().out.splitlines()) == 3


def test_a_silent_supervisor_is_named(session):
    with pytest.raises(CommandFailed, match="supervisor does not tell"):
        budget.run(options())
