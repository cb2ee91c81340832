import pytest
from starlette.testclient import TestClient

from vla_deploy.dashboard.access import UserRole

ELSEWHERE = "192.168.1.7"
PASSWORD = "the robot wears blue socks"
STATE, COMMANDS = "/api/v1/state", "/api/v1/commands"


def log_in(client, user="ann", password=PASSWORD):
    return client.post("/api/v1/login", json={"user": user, "password": password})


@pytest.fixture
def made(world):
    made = world()
    made.add_user("ann", UserRole.OPERATOR)
    return made


def test_who_is_not_logged_in_is_told_so(made):
    told = made.client(ELSEWHERE).get("/api/v1/session").json()
    assert told == {
        "role": "anyone", "user": "anyone", "way": "none", "csrf": "", "login_needed": True
    }  # fmt: skip


def test_a_login_lets_in_until_the_logout(made):
    client = made.client(ELSEWHERE)
    told = log_in(client).json()
    assert (told["role"], told["user"], told["login_needed"]) == ("operator", "ann", False)
    assert client.get(STATE).json()["user"] == "ann"
    assert client.get("/api/v1/session").json() == told
    assert client.post("/api/v1/logout", headers={"x-csrf-token": told["csrf"]}).status_code == 200
    assert client.get(STATE).status_code == 401


def test_the_cookie_is_for_no_script_and_no_other_site(made):
    cookie = log_in(made.client(ELSEWHERE)).headers["set-cookie"]
    assert "HttpOnly" in cookie
    assert "SameSite=strict" in cookie
    assert "Path=/" in cookie
    assert "Domain" not in cookie


def test_under_https_the_cookie_never_leaves_in_the_clear(world):
    made = world(is_https=True)
    made.add_user("ann", UserRole.OPERATOR)
    cookie = log_in(made.client(ELSEWHERE)).headers["set-cookie"]
    assert cookie.startswith("__Host-vla_session=")
    assert "Secure" in cookie


@pytest.mark.parametrize(
    ("user", "password"), [("ann", "not this one"), ("bob", PASSWORD), ("", "hunter2hunter2")]
)
def test_a_wrong_login_says_no_more_than_that(made, user, password):
    refused = log_in(made.client(ELSEWHERE), user, password)
    assert refused.status_code in (401, 422)
    assert "set-cookie" not in refused.headers
    assert password not in refused.text


def test_unknown_user_and_wrong_password_read_alike(made):
    one = log_in(made.client(ELSEWHERE), "ann", "wrong").text
    assert one == log_in(made.client(ELSEWHERE), "bob", "wrong").text


def test_a_change_repeats_what_the_session_said(made):
    client = made.client(ELSEWHERE)
    csrf = log_in(client).json()["csrf"]
    refused = client.post(COMMANDS, json={})
    assert (refused.status_code, refused.json()["error"]["code"]) == (403, "csrf_refused")
    assert client.post(COMMANDS, json={}, headers={"x-csrf-token": csrf + "x"}).status_code == 403
    assert client.post(COMMANDS, json={}, headers={"x-csrf-token": csrf}).status_code == 200


def test_the_word_of_one_session_is_worth_nothing_in_another(made):
    one, other = made.client(ELSEWHERE), made.client(ELSEWHERE)
    log_in(one)
    csrf = log_in(other).json()["csrf"]
    assert one.post(COMMANDS, json={}, headers={"x-csrf-token": csrf}).status_code == 403


def test_a_session_that_somebody_else_chose_is_never_taken_over(made):
    client = made.client(ELSEWHERE, cookies={"vla_session": "chosen-by-mallory"})
    assert "chosen-by-mallory" not in log_in(client).headers["set-cookie"]
    mallory = made.client(ELSEWHERE, cookies={"vla_session": "chosen-by-mallory"})
    assert mallory.get(STATE).status_code == 401


def test_a_second_login_ends_the_first_session_of_the_browser(made):
    client = made.client(ELSEWHERE)
    log_in(client)
    first = client.cookies["vla_session"]
    log_in(client)
    thief = made.client(ELSEWHERE, cookies={"vla_session": first})
    assert thief.get(STATE).status_code == 401


def test_a_session_ends_when_nobody_uses_it(made):
    client = made.client(ELSEWHERE)
    log_in(client)
    made.clock.pass_s(made.access.rules.session_idle_s - 1)
    assert client.get(STATE).status_code == 200
    made.clock.pass_s(made.access.rules.session_idle_s + 1)
    assert client.get(STATE).status_code == 401


def test_a_session_ends_some_day_however_it_is_used(made):
    client = made.client(ELSEWHERE)
    log_in(client)
    for _ in range(20):
        made.clock.pass_s(made.access.rules.session_longest_s / 19)
        client.get(STATE)
    assert client.get(STATE).status_code == 401


def test_a_new_password_ends_the_sessions_of_the_old_one(made):
    client = made.client(ELSEWHERE)
    log_in(client)
    made.add_user("ann", UserRole.OPERATOR, "the robot wears red socks now")
    assert client.get(STATE).status_code == 401


def test_a_role_that_is_taken_away_is_gone_at_once(made):
    client = made.client(ELSEWHERE)
    csrf = log_in(client).json()["csrf"]
    user = made.access.accounts.read().users["ann"].model_copy(update={"role": UserRole.VIEWER})
    made.access.accounts.change(lambda held: (held.with_user("ann", user), None))
    refused = client.post(COMMANDS, json={}, headers={"x-csrf-token": csrf})
    assert (refused.status_code, refused.json()["error"]["code"]) == (403, "role_too_low")


def test_who_guesses_waits_ever_longer(made):
    client = made.client(ELSEWHERE)
    guesses = [log_in(client, password=f"guess {number}").status_code for number in range(6)]
    assert guesses == [401] * 5 + [429]
    waits = []
    for _ in range(4):
        waits.append(int(log_in(client).headers["retry-after"]))
        made.clock.pass_s(waits[-1])
        assert log_in(client, password="again wrong").status_code == 401
    assert waits == [1, 2, 4, 8]
    made.clock.pass_s(16)
    assert log_in(client).status_code == 200


def test_guesses_from_elsewhere_do_not_lock_out_the_owner_for_long(made):
    for number in range(12):
        log_in(made.client(f"10.0.0.{number}"), password="wrong")
    made.clock.pass_s(30)
    assert log_in(made.client(ELSEWHERE)).status_code == 200


def test_a_file_of_accounts_that_others_may_read_lets_nobody_in(made):
    client = made.client(ELSEWHERE)
    log_in(client)
    made.access.accounts.path.chmod(0o640)
    refused = client.get(STATE)
    assert (refused.status_code, refused.json()["error"]["code"]) == (503, "accounts_away")
    assert log_in(client).status_code == 503
    assert client.post("/api/v1/stop").status_code == 200


def bearer(client: TestClient, token: str):
    return client.get(STATE, headers={"authorization": f"Bearer {token}"})


def test_a_token_lets_in_with_its_role(made):
    token = made.add_token("grafana", UserRole.VIEWER)
    client = made.client(ELSEWHERE)
    assert bearer(client, token).json() == {
        "user": "token:grafana", "role": "viewer", "way": "token"
    }  # fmt: skip
    asked = {"authorization": f"Bearer {token}"}
    assert client.post(COMMANDS, json={}, headers=asked).status_code == 403


@pytest.mark.parametrize(
    "spoil",
    [
        lambda token: token[:-1] + ("0" if token[-1] != "0" else "1"),
        lambda token: token + " ",
        lambda token: token.upper(),
        lambda token: "",
        lambda token: "../../etc/passwd",
        lambda token: "vla_" + 8 * "f" + token[12:],
    ],
)
def test_anything_but_the_token_itself_is_refused_also_on_loopback(made, spoil):
    token = spoil(made.add_token("grafana", UserRole.VIEWER))
    expected = 200 if token.endswith(" ") else 401
    assert bearer(made.client(ELSEWHERE), token).status_code == expected
    assert bearer(made.client(), token).status_code == expected


def test_a_revoked_token_is_refused_from_then_on(made):
    token = made.add_token("grafana", UserRole.VIEWER)
    client = made.client(ELSEWHERE)
    assert bearer(client, token).status_code == 200
    made.access.accounts.change(lambda held: (held.without_token("grafana"), None))
    assert bearer(client, token).status_code == 401


def test_a_token_ends_when_it_was_to_end_and_no_clock_revives_it(made):
    token = made.add_token("grafana", UserRole.VIEWER, lasts_s=3600)
    client = made.client(ELSEWHERE)
    made.wall[0] += 3599
    assert bearer(client, token).status_code == 200
    made.wall[0] += 1
    assert bearer(client, token).status_code == 401
    made.wall[0] -= 30 * 365 * 86400  # a board without a battery starts in the past
    assert bearer(client, token).status_code == 401


def test_neither_file_nor_log_holds_a_password_or_a_token(made):
    token = made.add_token("grafana", UserRole.VIEWER)
    client = made.client(ELSEWHERE)
    log_in(client)
    log_in(client, PASSWORD, PASSWORD)  # typed into the wrong field
    bearer(client, token)
    folder = made.access.accounts.path.parent
    written = b"".join(path.read_bytes() for path in folder.iterdir())
    session = client.cookies["vla_session"]
    for secret in (PASSWORD, token, token[13:], session):
        assert secret.encode() not in written
    assert {path.stat().st_mode & 0o777 for path in folder.iterdir()} == {0o600}
    assert folder.stat().st_mode & 0o777 == 0o700
