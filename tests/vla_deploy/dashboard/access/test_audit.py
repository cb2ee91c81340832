import json

import pytest

from vla_deploy.client.access.audit_log import AuditEntry, AuditFile, AuditLog, AuditOutcome
from vla_deploy.dashboard.access import UserRole

ELSEWHERE = "192.168.1.7"


def entry(act="POST /x", outcome=AuditOutcome.DONE, **changes):
    told = {"user": "ann", "role": "admin", "way": "session", "address": ELSEWHERE}
    return AuditEntry(act=act, outcome=outcome, **{**told, **changes})


def test_an_act_is_told_with_who_where_what_and_outcome(world):
    made = world()
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


@pytest.mark.parametrize("text", ['two\nlines {"user": "forged"}', "\x1b[31mred", "\u2028", "\x00"])
def test_nothing_that_somebody_sends_makes_a_line_of_its_own(tmp_path, text):
    file = AuditFile(tmp_path / "audit.jsonl")
    file.append(entry(details={"text": text}).document(0.0))
    (line,) = file.path.read_bytes().split(b"\n")[:-1]
    assert line.isascii()
    assert line.decode().isprintable()
    assert json.loads(line)["details"]["text"] == text


def test_the_files_stay_small_and_few_and_the_newest_stay(tmp_path, hand_clock):
    log = AuditLog(AuditFile(tmp_path / "audit.jsonl", 2000, 3), hand_clock, now_s=lambda: 0.0)
    for number in range(100):
        log.record(entry(act=f"POST /{number}"))
    files = list(tmp_path.glob("audit.jsonl*"))
    assert len(files) == 3
    assert sum(file.stat().st_size for file in files) <= 6000
    assert [told["act"] for told in log.newest(3)] == ["POST /99", "POST /98", "POST /97"]


def test_a_line_that_was_cut_off_spoils_no_other(tmp_path):
    file = AuditFile(tmp_path / "audit.jsonl")
    file.append({"act": "one"})
    with file.path.open("ab") as end:
        end.write(b'{"act": "tw\n')
    file.append({"act": "three"})
    assert [told["act"] for told in file.newest(10)] == ["three", "one"]


def test_what_could_not_be_written_is_counted(tmp_path, hand_clock, caplog):
    file = AuditFile(tmp_path / "audit.jsonl")
    log = AuditLog(file, hand_clock, now_s=lambda: 0.0)
    file.path.mkdir()
    log.record(entry())
    log.record(entry())
    assert "missing in the audit log" in caplog.text
    file.path.rmdir()
    log.record(entry())
    (told,) = log.newest(10)
    assert told["lost"] == 2


def test_a_link_in_its_place_is_not_followed(tmp_path, hand_clock, caplog):
    aim = tmp_path / "aim"
    aim.write_text("")
    file = AuditFile(tmp_path / "audit.jsonl")
    file.path.symlink_to(aim)
    AuditLog(file, hand_clock, now_s=lambda: 0.0).record(entry())
    assert aim.read_text() == ""
    assert "missing in the audit log" in caplog.text


def test_an_admin_reads_it(world):
    made = world()
    made.client().post("/api/v1/profile", json={})
    entries = made.client().get("/api/v1/audit?limit=5").json()["entries"]
    assert [told["act"] for told in entries] == ["POST /api/v1/profile"]


def test_nobody_else_does(world):
    made = world()
    token = made.add_token("eyes", UserRole.OPERATOR)
    asked = {"authorization": f"Bearer {token}"}
    assert made.client(ELSEWHERE).get("/api/v1/audit", headers=asked).status_code == 403
