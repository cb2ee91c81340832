import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.clock import MonotonicClock
from vla_deploy.ipc import ClaimBook, ClaimRefused, SharedSpace

HOLDER = """
import sys
from pathlib import Path
from drivers.clock import MonotonicClock
from vla_deploy.ipc import ClaimBook, SharedSpace
clock = MonotonicClock()
book = ClaimBook(SharedSpace(Path(sys.argv[1]), clock), clock)
print(book.ask("model", {"ram_mb": 700}), flush=True)
sys.stdin.read()
"""
CONTENDER = """
import sys
from pathlib import Path
from drivers.clock import MonotonicClock
from vla_deploy.ipc import ClaimBook, SharedSpace
clock = MonotonicClock()
book = ClaimBook(SharedSpace(Path(sys.argv[1]), clock), clock)
name = sys.argv[2]
for _ in range(60):
    granted = book.ask(name, {"ram_mb": 400})
    look = book.look()
    assert look.used("ram_mb") <= 1000, look
    book.release(name)
"""


def book_in(folder: Path) -> ClaimBook:
    clock = MonotonicClock()
    return ClaimBook(SharedSpace(folder, clock), clock)


@pytest.fixture
def book(tmp_path: Path) -> ClaimBook:
    book = book_in(tmp_path)
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
    second = book_in(tmp_path)
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
    book = ClaimBook(SharedSpace(tmp_path, clock), clock)
    book.declare({"base": 1})
    book.ask("a", {"base": 1})
    assert not book.ask("b", {"base": 1}, timeout_s=2.0)
    clock.ns = 1_999_999_999
    assert book.look().waits("b")
    clock.ns = 2_000_000_000
    assert not book.look().waits("b")


def test_more_claims_than_there_is_room_for_are_refused_and_the_others_stay(book: ClaimBook):
    with pytest.raises(ClaimRefused, match="too many claims"):
        for number in range(1000):
            book.ask(f"holder {number}", {"base": 1})
    assert book.look().holds("holder 0")
    book.release("holder 0")
    assert book.look().holds("holder 1")


def test_a_look_that_changes_nothing_writes_nothing(book: ClaimBook, tmp_path: Path):
    cell = SharedSpace(tmp_path, MonotonicClock()).cell_reader("claims")
    before = cell.latest()
    book.look()
    assert cell.latest() is before
