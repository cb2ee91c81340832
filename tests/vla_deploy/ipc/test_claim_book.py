import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.clock import MonotonicClock
from vla_deploy.ipc import ClaimBook, ClaimRefused, SpaceUnavailable

HOLDER = """
import sys
from pathlib import Path
from drivers.clock import MonotonicClock
from vla_deploy.ipc import ClaimBook
book = ClaimBook(Path(sys.argv[1]), MonotonicClock())
print(book.ask("model", {"ram_mb": 700}), flush=True)
sys.stdin.read()
"""
CONTENDER = """
import sys
from pathlib import Path
from drivers.clock import MonotonicClock
from vla_deploy.ipc import ClaimBook
book = ClaimBook(Path(sys.argv[1]), MonotonicClock())
name = sys.argv[2]
for _ in range(60):
    granted = book.ask(name, {"ram_mb": 400})
    look = book.look()
    assert look.used("ram_mb") <= 1000, look
    book.release(name)
"""


@pytest.fixture
def book(tmp_path: Path) -> ClaimBook:
    book = ClaimBook(tmp_path, MonotonicClock())
    book.declare({"base": 1, "ram_mb": 1000})
    return book


@pytest.fixture
def other(tmp_path: Path, book: ClaimBook) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-c", HOLDER, str(tmp_path)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "True\n"
        yield holder
        holder.kill()


def test_what_one_opens_another_sees(book: ClaimBook, tmp_path: Path):
    assert book.ask("a", {"base": 1})
    second = ClaimBook(tmp_path, MonotonicClock())
    assert not second.ask("b", {"base": 1})
    assert second.obstacles({"base": 1}) == "base is held by a"
    book.release("a")
    assert second.look().holds("b")


def test_another_process_holds_what_it_was_granted(book: ClaimBook, other):
    assert not book.ask("mine", {"ram_mb": 700})
    assert book.obstacles({"ram_mb": 700}) == "ram_mb is held by model (700)"


def test_what_a_killed_process_held_goes_to_who_waits(book: ClaimBook, other):
    assert not book.ask("mine", {"ram_mb": 700})
    other.kill()
    other.wait()
    assert book.look().holds("mine")


def test_a_process_that_nobody_has_reaped_holds_nothing(book: ClaimBook, other):
    other.kill()
    while Path(f"/proc/{other.pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z":
        pass
    assert book.ask("mine", {"ram_mb": 700})


def test_processes_that_contend_never_hold_more_than_there_is(book: ClaimBook, tmp_path: Path):
    contenders = [
        subprocess.Popen([sys.executable, "-c", CONTENDER, str(tmp_path), f"c{number}"])
        for number in range(3)
    ]
    assert [contender.wait(timeout=20) for contender in contenders] == [0, 0, 0]
    assert book.look().granted == ()


def test_a_claim_that_can_never_be_granted_changes_nothing(book: ClaimBook):
    before = book.look()
    with pytest.raises(ClaimRefused, match="expected 1 to 1000"):
        book.ask("a", {"ram_mb": 2000})
    assert book.look() == before


def test_waiting_ends_after_its_time(tmp_path: Path):
    class Clock:
        ns = 0

        def now_ns(self) -> int:
            return self.ns

        def sleep_until(self, deadline_ns: int) -> None:
            self.ns = deadline_ns

    clock = Clock()
    book = ClaimBook(tmp_path, clock)
    book.declare({"base": 1})
    book.ask("a", {"base": 1})
    assert not book.ask("b", {"base": 1}, timeout_s=2.0)
    clock.ns = 1_999_999_999
    assert book.look().waits("b")
    clock.ns = 2_000_000_000
    assert not book.look().waits("b")


def test_a_folder_that_is_not_there_is_named(tmp_path: Path):
    with pytest.raises(SpaceUnavailable, match="gone"):
        ClaimBook(tmp_path / "gone", MonotonicClock()).look()
