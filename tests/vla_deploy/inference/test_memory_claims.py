import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.clock import MonotonicClock
from platforms import Profile, load_profile
from vla_deploy.inference.errors import MemoryRefused
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.ipc import ClaimBook, SharedSpace

CLOCK = MonotonicClock()
ROLE = "detector"


@pytest.fixture(scope="module")
def profile() -> Profile:
    return load_profile("desktop")


@pytest.fixture
def run_dir(tmp_path: Path) -> Path:
    return tmp_path / "run"


@pytest.fixture
def book(run_dir: Path) -> ClaimBook:
    return ClaimBook(SharedSpace(run_dir / "ipc", CLOCK), CLOCK)


@pytest.fixture
def shelf(run_dir: Path) -> ModelShelf:
    return ModelShelf.of_run(run_dir, CLOCK)


def test_a_model_claims_what_it_took_until_it_is_closed(
    shelf: ModelShelf, book: ClaimBook, profile: Profile
) -> None:
    book.declare({"ram_mb": 500})
    session = shelf.open(ROLE, profile, 0)
    (claim,) = book.look().granted
    assert claim.holder.startswith(f"detector detector {os.getpid()}.")
    assert 1 <= claim.wants["ram_mb"] <= session.memory_mb * 1.1 + 20
    session.close()
    session.close()
    assert book.look().granted == ()


def test_a_model_is_not_loaded_where_others_hold_the_memory(
    shelf: ModelShelf, book: ClaimBook, profile: Profile
) -> None:
    book.declare({"ram_mb": 500})
    book.ask("planner", {"ram_mb": 500})
    with pytest.raises(MemoryRefused, match=r"ram_mb is held by planner \(500\); choose a smaller"):
        shelf.open(ROLE, profile, 0)
    assert [one.holder for one in book.look().granted] == ["planner"]
    assert book.look().waiting == ()
    book.release("planner")
    shelf.open(ROLE, profile, 0).close()


def test_a_model_larger_than_all_there_is_is_refused(
    shelf: ModelShelf, book: ClaimBook, profile: Profile
) -> None:
    book.declare({"ram_mb": 0})
    with pytest.raises(MemoryRefused, match="expected 1 to 0"):
        shelf.open(ROLE, profile, 0)


def test_two_of_the_same_model_have_a_claim_each(
    shelf: ModelShelf, book: ClaimBook, profile: Profile
) -> None:
    book.declare({"ram_mb": 500})
    old, new = shelf.open(ROLE, profile, 0), shelf.open(ROLE, profile, 0)
    assert len(book.look().granted) == 2
    old.close()
    assert len(book.look().granted) == 1
    new.close()


def test_what_cannot_be_loaded_keeps_no_claim(
    shelf: ModelShelf, book: ClaimBook, profile: Profile
) -> None:
    book.declare({"ram_mb": 500})
    model = shelf.store.load("detector")
    with pytest.raises(ZeroDivisionError):
        shelf.load(model, profile.models[ROLE], lambda: 1 / 0)  # type: ignore[type-var]
    assert book.look().granted == ()


def test_where_no_run_declares_memory_nothing_is_claimed(
    shelf: ModelShelf, book: ClaimBook, profile: Profile, tmp_path: Path
) -> None:
    shelf.open(ROLE, profile, 0).close()
    assert book.look().granted == ()
    tool = ModelShelf.of_base(tmp_path, CLOCK)
    tool.open(ROLE, profile, 0).close()
    assert tool.memory is None


def test_a_graphics_processor_is_claimed_where_one_would_run_it(
    shelf: ModelShelf, book: ClaimBook, profile: Profile, monkeypatch: pytest.MonkeyPatch
) -> None:
    cuda = "CUDAExecutionProvider"
    monkeypatch.setattr("vla_deploy.inference.memory_claims.available_providers", lambda: (cuda,))
    choice = replace(profile.models[ROLE], providers=(cuda,), cpu_fallback=True)
    on_gpu = replace(profile, models={ROLE: choice})
    book.declare({"ram_mb": 500, "gpu_memory_mb": 100})
    session = shelf.open(ROLE, on_gpu, 0)
    (claim,) = book.look().granted
    assert claim.wants.keys() == {"ram_mb", "gpu_memory_mb"}
    session.close()


HOLDING = """
import sys
from pathlib import Path
from drivers.clock import MonotonicClock
from platforms import load_profile
from vla_deploy.inference.roles import ModelShelf
shelf = ModelShelf.of_run(Path(sys.argv[1]), MonotonicClock())
session = shelf.open("detector", load_profile("desktop"), 0)
print("held", flush=True)
sys.stdin.read()
"""


def test_the_claim_of_a_process_that_is_killed_is_free_again(
    run_dir: Path, book: ClaimBook
) -> None:
    book.declare({"ram_mb": 500})
    with subprocess.Popen(
        [sys.executable, "-c", HOLDING, str(run_dir)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        assert len(book.look().granted) == 1
        holder.kill()
        holder.wait()
    assert book.look().granted == ()
