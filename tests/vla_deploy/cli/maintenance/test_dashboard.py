"""`vla-deploy dashboard`: the page's address, accounts, tokens and the audit log."""

import argparse
import io
import json
from types import SimpleNamespace

import pytest

from vla_deploy.cli.errors import CommandFailed, UsageError
from vla_deploy.cli.maintenance import dashboard
from vla_deploy.client.access.accounts import AccountsFile, UserRole, wall_s
from vla_deploy.client.access.errors import AccountRefused, AccountsUnusable
from vla_deploy.client.access.passwords import Cost, hash_password, matches

URL = "http://127.0.0.1:8088"
LINK = f"{URL}/#/login/abc"
CHEAP = Cost(log2_rounds=10, block=1, parallel=1)


def show_address(session, monkeypatch, **options):
    monkeypatch.setattr(dashboard, "attach", lambda _: session)
    monkeypatch.setattr(dashboard, "login_url", lambda run_dir, url: f"{url}/#/login/abc")
    chosen = {"runtime_base": None, "open": False, "json": False} | options
    return dashboard.show_address(SimpleNamespace(**chosen))


def test_the_address_is_one_line_for_a_person_and_json_for_a_script(
    session, robot, monkeypatch, capsys
):
    robot.space.cell_writer("dashboard_status").put_document({"url": URL, "port": 8088})
    assert show_address(session, monkeypatch) == 0
    assert capsys.readouterr().out == f"{LINK}\n"
    show_address(session, monkeypatch, json=True)
    told = json.loads(capsys.readouterr().out)
    assert (told["port"], told["url"], told["login_url"]) == (8088, URL, LINK)


def test_a_dashboard_that_does_not_run_is_told_with_the_supervisors_reason(
    session, robot, monkeypatch
):
    row = {"name": "dashboard", "state": "given up", "reason": "127.0.0.1:8088: another program"}
    robot.space.cell_writer("process_table").put_document({"processes": [row]})
    with pytest.raises(CommandFailed, match=r"it is given up \(127.0.0.1:8088: another program\)"):
        show_address(session, monkeypatch)


def test_without_a_browser_the_address_is_told_for_another_computer(session, robot, monkeypatch):
    robot.space.cell_writer("dashboard_status").put_document({"url": URL, "port": 8088})
    opened: list[str] = []
    monkeypatch.setattr(dashboard.webbrowser, "open", lambda url: bool(opened.append(url)))
    with pytest.raises(CommandFailed, match=f"no browser .* open {LINK} elsewhere"):
        show_address(session, monkeypatch, open=True)
    page = session.run_dir / "login.html"  # others see what a browser is started with
    assert opened == [page.resolve().as_uri()]
    assert (LINK in page.read_text(), page.stat().st_mode & 0o077) == (True, 0)


@pytest.fixture
def base(tmp_path, monkeypatch):
    monkeypatch.setattr(dashboard, "hash_password", lambda password: hash_password(password, CHEAP))
    return tmp_path / "base"


@pytest.fixture
def run(base, capsys):
    """Run `vla-deploy dashboard ...` and return what it prints."""

    def run(*words):
        parser = argparse.ArgumentParser()
        parser.set_defaults(runtime_base=base)
        acts = parser.add_subparsers()
        dashboard.register_acts(acts)
        arguments = parser.parse_args(words)
        assert arguments.run(arguments) == 0
        return capsys.readouterr().out.strip()

    return run


def accounts(base):
    return AccountsFile.of_base(base).read()


def test_the_first_password_is_generated_shown_once_and_stored_as_a_hash(run, base):
    password = run("password")
    admin = accounts(base).users["admin"]
    assert admin.role is UserRole.ADMIN
    assert matches(password, admin.password)
    assert len(password) >= 20
    written = b"".join(path.read_bytes() for path in (base.parent / "base-state").rglob("*.*"))
    assert password.encode() not in written
    assert password not in run("users") + run("audit")


def test_a_new_password_is_another_one_and_leaves_the_role_as_it_was(run, base):
    first = run("password", "ann", "--role", "operator")
    assert run("password", "ann") != first
    assert accounts(base).users["ann"].role is UserRole.OPERATOR


def test_a_password_of_ones_own_comes_by_standard_input(run, base, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("four plain old words\n"))
    run("password", "ann", "--role", "viewer", "--stdin")
    assert matches("four plain old words", accounts(base).users["ann"].password)


@pytest.mark.parametrize("given", ["short\n", "", "x" * 300])
def test_one_that_is_too_short_or_too_long_is_refused(run, monkeypatch, given):
    monkeypatch.setattr("sys.stdin", io.StringIO(given))
    with pytest.raises(UsageError, match="12 to 256"):
        run("password", "--stdin")


@pytest.mark.parametrize("name", ["Ann", "../x", "", "a b", "x" * 40, "token:a"])
def test_a_name_that_is_none_is_refused(run, name):
    with pytest.raises(AccountRefused, match="small letter"):
        run("password", name)


def test_an_account_is_removed(run, base):
    run("password", "ann")
    run("users", "--remove", "ann")
    assert accounts(base).users == {}
    with pytest.raises(AccountRefused, match="no user 'ann'"):
        run("users", "--remove", "ann")


def test_a_token_is_shown_once_counts_for_its_days_and_can_be_revoked(run, base):
    text = run("token", "add", "prometheus", "--role", "viewer", "--days", "2")
    held = accounts(base)
    now_s = wall_s()
    token = held.token_of(text, now_s)
    assert token.role is UserRole.VIEWER
    assert held.token_of(text, now_s + 2.1 * 86_400) is None
    assert text not in run("token", "list") + run("audit", "--json")
    run("token", "revoke", "prometheus")
    assert accounts(base).token_of(text, now_s) is None


def test_a_second_token_of_a_name_is_refused(run):
    run("token", "add", "prometheus", "--role", "viewer")
    with pytest.raises(AccountRefused, match="revoke it"):
        run("token", "add", "prometheus", "--role", "admin")


@pytest.mark.parametrize("days", ["0", "-1", "1e9", "nan"])
def test_a_token_for_no_time_is_refused(run, days):
    with pytest.raises(UsageError, match="--days"):
        run("token", "add", "x", "--role", "viewer", "--days", days)


def test_what_is_done_here_is_told_by_the_audit_log(run):
    run("password", "ann", "--role", "viewer")
    run("token", "add", "prometheus", "--role", "viewer")
    entries = [json.loads(line) for line in run("audit", "--json").splitlines()]
    assert [entry["act"] for entry in entries] == ["dashboard password", "dashboard token add"]
    assert "prometheus" in run("audit", "--count", "1")


def test_faults_of_the_file_are_told_without_what_it_holds(run, base):
    run("password", "ann")
    file = AccountsFile.of_base(base).path
    document = json.loads(file.read_text())
    document["users"]["ann"]["password"] = "plainly written"
    file.write_text(json.dumps(document))
    with pytest.raises(AccountsUnusable, match=r"users\.ann\.password: .*expected scrypt") as told:
        run("users")
    assert "plainly written" not in str(told.value)
