"""The audit log stays small and whole, whatever is recorded and whatever the disk does."""

import json

import pytest

from sim_twin.contracts.scripted import ManualClock
from vla_deploy.client.access.audit_log import AuditEntry, AuditFile, AuditLog, AuditOutcome

ELSEWHERE = "192.168.1.7"


def entry(act="POST /x", outcome=AuditOutcome.DONE, **changes):
    told = {"user": "ann", "role": "admin", "way": "session", "address": ELSEWHERE}
    return AuditEntry(act=act, outcome=outcome, **{**told, **changes})


@pytest.mark.parametrize("text", ['two\nlines {"user": "forged"}', "\x1b[31mred", "\u2028", "\x00"])
def test_nothing_that_somebody_sends_makes_a_line_of_its_own(tmp_path, text):
    file = AuditFile(tmp_path / "audit.jsonl")
    file.append(entry(details={"text": text}).document(0.0))
    (line,) = file.path.read_bytes().split(b"\n")[:-1]
    assert line.isascii()
    assert line.decode().isprintable()
    assert json.loads(line)["details"]["text"] == text


def test_the_files_stay_small_and_few_and_the_newest_stay(tmp_path):
    log = AuditLog(AuditFile(tmp_path / "audit.jsonl", 2000, 3), ManualClock(), now_s=lambda: 0.0)
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


def test_what_could_not_be_written_is_counted(tmp_path, caplog):
    file = AuditFile(tmp_path / "audit.jsonl")
    log = AuditLog(file, ManualClock(), now_s=lambda: 0.0)
    file.path.mkdir()
    log.record(entry())
    log.record(entry())
    assert "missing in the audit log" in caplog.text
    file.path.rmdir()
    log.record(entry())
    (told,) = log.newest(10)
    assert told["lost"] == 2


def test_a_link_in_its_place_is_not_followed(tmp_path, caplog):
    aim = tmp_path / "aim"
    aim.write_text("")
    file = AuditFile(tmp_path / "audit.jsonl")
    file.path.symlink_to(aim)
    AuditLog(file, ManualClock(), now_s=lambda: 0.0).record(entry())
    assert aim.read_text() == ""
    assert "missing in the audit log" in caplog.text
