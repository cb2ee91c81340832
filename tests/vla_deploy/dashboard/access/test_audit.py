from vla_deploy.dashboard.access import UserRole

ELSEWHERE = "192.168.1.7"


def test_an_act_is_told_with_who_where_what_and_outcome(world):
    made = world(trust_loopback=True)
    made.client().post("/api/v1/profile", json={})
    (told,) = made.audit()
    assert told == {
        "time": "2027-01-15T08:00:00.000+00:00",
        "user": "local",
        "role": "admin",
        "way": "loopback",
        "address": "127.0.0.1",
        "act": "POST /api/v1/profile",
        "outcome": "done",
    }


def test_what_is_refused_is_told_with_its_reason(world):
    made = world()
    made.client(ELSEWHERE).post("/api/v1/profile", json={})
    made.client(host="rebound.example").post("/api/v1/commands", json={})
    newest, oldest = made.audit()
    assert (oldest["act"], oldest["outcome"], oldest["code"]) == (
        "POST /api/v1/profile", "refused", "login_needed"
    )  # fmt: skip
    assert (newest["outcome"], newest["code"]) == ("refused", "host_refused")


def test_reading_is_no_act(world):
    made = world()
    made.client().get("/api/v1/state")
    made.client(ELSEWHERE).get("/api/v1/state")
    assert made.audit() == []


def test_a_stop_is_told_with_who_pressed_it(world):
    made = world()
    made.client(ELSEWHERE).post("/api/v1/stop", json={"reason": "smoke"})
    (told,) = made.audit()
    assert (told["act"], told["user"], told["address"]) == (
        "POST /api/v1/stop", "anyone", ELSEWHERE
    )  # fmt: skip


def test_a_flood_is_one_line_with_its_number(world):
    made = world()
    client = made.client(ELSEWHERE)
    for _ in range(50):
        client.post("/api/v1/stop")
    made.clock.pass_s(2)
    client.post("/api/v1/stop")
    newest, oldest = made.audit()
    assert "repeated" not in oldest
    assert newest["repeated"] == 49


def test_whatever_path_is_tried_the_refusals_are_folded(world):
    made = world()
    client = made.client(ELSEWHERE)
    for number in range(15):
        client.post(f"/api/v1/no-such-{number}", json={})
    assert [told["act"] for told in made.audit()] == ["POST (no route)"]


def test_an_admin_reads_it(world):
    made = world(trust_loopback=True)
    made.client().post("/api/v1/profile", json={})
    entries = made.client().get("/api/v1/audit?limit=5").json()["entries"]
    assert [told["act"] for told in entries] == ["POST /api/v1/profile"]


def test_nobody_else_does(world):
    made = world()
    token = made.add_token("eyes", UserRole.OPERATOR)
    asked = {"authorization": f"Bearer {token}"}
    assert made.client(ELSEWHERE).get("/api/v1/audit", headers=asked).status_code == 403
