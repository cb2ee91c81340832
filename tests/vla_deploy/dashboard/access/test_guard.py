import pytest
from starlette.testclient import WebSocketDenialResponse

STATE, LIVE, STOP = "/api/v1/state", "ws://{}:8088/api/v1/live", "/api/v1/stop"


def code(response):
    return response.json()["error"]["code"]


def test_a_user_of_this_computer_is_unknown_like_any_other(world):
    client = world().client()
    refused = client.get(STATE)
    assert (refused.status_code, code(refused)) == (401, "login_needed")
    assert client.post("/api/v1/profile", json={}).status_code == 401
    assert client.post(STOP).json()["pressed_by"] == "anyone"


def test_where_the_settings_trust_loopback_all_of_this_computer_are_admins(world):
    told = world(trust_loopback=True).client().get(STATE).json()
    assert told == {"user": "local", "role": "admin", "way": "loopback"}


def test_whoever_comes_from_elsewhere_logs_in_first(world):
    refused = world().client("192.168.1.7").get(STATE)
    assert refused.status_code == 401
    assert code(refused) == "login_needed"


@pytest.mark.parametrize("name", ["forwarded", "x-forwarded-for", "via", "x-real-ip"])
def test_what_a_proxy_on_this_computer_passes_on_is_not_believed(world, name):
    assert world(trust_loopback=True).client().get(STATE, headers={name: "1"}).status_code == 401


def test_a_name_that_only_resolves_to_the_robot_is_refused(world):
    refused = world().client(host="rebound.example").get(STATE)
    assert (refused.status_code, code(refused)) == (421, "host_refused")


def test_a_name_that_the_settings_add_is_the_robots_but_not_this_computers(world):
    client = world(hosts=("robot.example",)).client(host="robot.example")
    assert client.get(STATE).status_code == 401


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:3000"])
def test_no_other_page_changes_anything(world, origin):
    asked = {"origin": origin, "content-type": "application/json"}
    refused = world().client().post("/api/v1/commands", content="{}", headers=asked)
    assert (refused.status_code, code(refused)) == (403, "origin_refused")


def test_the_own_page_does(world):
    client = world(trust_loopback=True).client()
    asked = {"origin": "http://127.0.0.1:8088"}
    assert client.post("/api/v1/commands", json={}, headers=asked).json()["user"] == "local"


def test_a_proxys_page_does_where_the_settings_name_it(world):
    client = world(origins=("https://robot.example",), trust_loopback=True).client()
    asked = {"origin": "https://robot.example"}
    assert client.post("/api/v1/commands", json={}, headers=asked).status_code == 200


def test_no_other_page_reads_anything_where_browsers_tell_the_site(world):
    asked = {"sec-fetch-site": "cross-site", "sec-fetch-mode": "no-cors"}
    assert world().client().get(STATE, headers=asked).status_code == 403


def test_a_link_from_another_site_opens_the_page(world):
    asked = {"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate"}
    assert world(trust_loopback=True).client().get(STATE, headers=asked).status_code == 200


def test_no_other_page_opens_a_websocket(world):
    client = world().client()
    asked = {"origin": "http://evil.example"}
    with (
        pytest.raises(WebSocketDenialResponse) as denied,
        client.websocket_connect(LIVE.format("127.0.0.1"), headers=asked),
    ):
        pass
    assert denied.value.status_code == 403


def test_the_own_page_opens_a_websocket(world):
    asked = {"origin": "http://127.0.0.1:8088"}
    url = LIVE.format("127.0.0.1")
    with world(trust_loopback=True).client().websocket_connect(url, headers=asked) as socket:
        assert socket.receive_json() == {"user": "local"}


def test_a_stranger_opens_no_websocket(world):
    client = world().client("192.168.1.7")
    with (
        pytest.raises(WebSocketDenialResponse) as denied,
        client.websocket_connect(LIVE.format("192.168.1.4")),
    ):
        pass
    assert denied.value.status_code == 401


@pytest.mark.parametrize(
    "body",
    [
        *(b"", b"{", b"[1]", b"null", b'"stop"', b"[" * 100_000, b"x" * 300_000),
        *(b'{"reason": 3}', b'{"reason": []}', b'{"reason": {}}', b'{"reason": null}'),
        b'{"reason": "\\ud800"}',
    ],
)
@pytest.mark.parametrize(
    "asked",
    [
        {},
        {"host": "rebound.example"},
        {"origin": "http://evil.example", "content-type": "text/plain"},
        {"authorization": "Bearer vla_00000000_" + 64 * "0"},
    ],
)
def test_nothing_that_is_wrong_with_a_press_refuses_the_stop(world, body, asked):
    pressed = world().client("192.168.1.7").post(STOP, content=body, headers=asked)
    assert pressed.status_code == 200
    assert pressed.json()["pressed_by"] == "anyone"


def test_a_stop_carries_its_reason(world):
    pressed = world(trust_loopback=True).client().post(STOP, json={"reason": "it smokes"})
    assert pressed.json() == {"pressed_by": "local", "reason": "it smokes"}


def test_however_often_it_is_pressed_the_stop_is_taken(world):
    client = world().client("192.168.1.7")
    assert {client.post(STOP).status_code for _ in range(50)} == {200}


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (b"[" * 5000 + b"]" * 5000, 400),
        (b'{"a": NaN}', 400),
        (b'{"a": "\\udc00"}', 400),
        (b'{"a": 1' + 5000 * b"0" + b"}", 400),
        (b'{"a": "\xff"}', 400),
        (b'{"a": "' + b"x" * 140_000 + b'"}', 413),
    ],
)
def test_a_body_that_could_break_a_route_does_not_reach_one(world, body, status):
    asked = {"content-type": "application/json"}
    refused = world().client().post("/api/v1/commands", content=body, headers=asked)
    assert refused.status_code == status
    assert set(refused.json()["error"]) == {"code", "what", "try"}


def test_a_form_of_another_page_is_no_body(world):
    asked = {"content-type": "text/plain"}
    assert (
        world().client().post("/api/v1/commands", content=b"{}", headers=asked).status_code == 400
    )


def test_a_stranger_is_slowed_down(world):
    made = world()
    client = made.client("192.168.1.7")
    statuses = [client.post("/api/v1/commands", json={}).status_code for _ in range(30)]
    assert statuses.count(429) == 10
    refused = client.post("/api/v1/commands", json={})
    assert int(refused.headers["retry-after"]) >= 1
    made.clock.pass_s(1.0)
    assert client.post("/api/v1/commands", json={}).status_code == 401


def test_one_who_is_slowed_down_does_not_hold_up_another(world):
    made = world(trust_loopback=True)
    slow = made.client("192.168.1.7")
    while slow.post("/api/v1/commands", json={}).status_code != 429:
        pass
    assert made.client().post("/api/v1/commands", json={}).status_code == 200
