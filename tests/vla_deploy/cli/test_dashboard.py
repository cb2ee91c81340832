"""The page's address is told, or why there is none."""

import json
from types import SimpleNamespace

import pytest

from vla_deploy.cli import dashboard
from vla_deploy.cli.errors import CommandFailed

URL = "http://127.0.0.1:8088"


def run(session, monkeypatch, **options):
    monkeypatch.setattr(dashboard, "attach", lambda _: session)
    chosen = {"runtime_base": None, "open": False, "json": False} | options
    return dashboard.run(SimpleNamespace(**chosen))


def test_the_address_is_one_line_for_a_person_and_json_for_a_script(
    session, robot, monkeypatch, capsys
):
    robot.space.cell_writer("dashboard_status").put_document({"url": URL, "port": 8088})
    assert run(session, monkeypatch) == 0
    assert capsys.readouterr().out == f"{URL}\n"
    run(session, monkeypatch, json=True)
    assert json.loads(capsys.readouterr().out)["port"] == 8088


def test_a_dashboard_that_does_not_run_is_told_with_the_supervisors_reason(
    session, robot, monkeypatch
):
    row = {"name": "dashboard", "state": "given up", "reason": "127.0.0.1:8088: another program"}
    robot.space.cell_writer("process_table").put_document({"processes": [row]})
    with pytest.raises(CommandFailed, match=r"it is given up \(127.0.0.1:8088: another program\)"):
        run(session, monkeypatch)


def test_without_a_browser_the_address_is_told_for_another_computer(session, robot, monkeypatch):
    robot.space.cell_writer("dashboard_status").put_document({"url": URL, "port": 8088})
    monkeypatch.setattr(dashboard.webbrowser, "open", lambda _: False)
    with pytest.raises(CommandFailed, match=f"no browser .* open {URL} elsewhere"):
        run(session, monkeypatch, open=True)
