"""The best recogniser that is there is taken, and what was left out is told."""

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from drivers.clock import MonotonicClock
from platforms import ModelChoice, Profile, load_profile
from vla_deploy.inference.memory_claims import RunMemory
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.inference.store import ModelStore
from vla_deploy.ipc import ClaimBook, SharedSpace
from vla_deploy.speech.model_selection import select_recogniser
from vla_deploy.speech.recogniser import Recogniser


@pytest.fixture
def shelf(scripted_whisper: Any) -> ModelShelf:
    store = ModelStore(scripted_whisper.folder, embedded=scripted_whisper.folder / "none")
    return ModelShelf(store=store, engines=scripted_whisper.folder, clock=MonotonicClock())


def open_best(shelf: ModelShelf, profile: Profile, model_tier: int) -> tuple[Recogniser, str]:
    """Return the recogniser, and why those before it were left out."""
    selected = select_recogniser(shelf, profile, model_tier)
    assert selected.recogniser is not None
    return selected.recogniser, selected.why


def profile_with(*tiers: str) -> Profile:
    profile = load_profile("desktop")
    choice: ModelChoice = dataclasses.replace(profile.models["speech_to_text"], tiers=tiers)
    return dataclasses.replace(profile, models={**profile.models, "speech_to_text": choice})


def test_the_first_tier_that_is_there_is_opened(shelf: ModelShelf, scripted_whisper: Any) -> None:
    scripted_whisper.model("small", "turn left")
    scripted_whisper.model("tiny", "turn right")
    profile = profile_with("whisper-small.en", "small", "tiny")
    recogniser, why = open_best(shelf, profile, 0)
    assert recogniser.model.manifest.name == "small"
    assert why == (
        "whisper-small.en is not here (vla-deploy models fetch whisper-small.en, or "
        "add whisper-small.en --whisper FOLDER)"
    )
    assert open_best(shelf, profile, 2)[0].model.manifest.name == "tiny"
    assert open_best(shelf, profile, 9)[0].model.manifest.name == "tiny"


def test_a_spoiled_model_gives_way_to_the_next(shelf: ModelShelf, scripted_whisper: Any) -> None:
    spoiled = scripted_whisper.model("spoiled", "turn left")
    (spoiled / "model.bin").write_bytes(b"half")
    scripted_whisper.model("tiny", "turn right")
    recogniser, why = open_best(shelf, profile_with("spoiled", "tiny"), 0)
    assert recogniser.model.manifest.name == "tiny"
    assert "expected SHA-256" in why


def test_a_model_too_large_for_the_memory_that_is_free_gives_way_to_a_smaller_one(
    shelf: ModelShelf, scripted_whisper: Any, tmp_path: Path
) -> None:
    large = scripted_whisper.model("large", "turn left")
    (large / "padding.bin").write_bytes(bytes(30_000_000))
    scripted_whisper.model("tiny", "turn right")
    clock, ipc = MonotonicClock(), tmp_path / "run" / "ipc"
    book = ClaimBook(SharedSpace(ipc, clock), clock)
    book.declare({"ram_mb": 40})
    book.ask("planner", {"ram_mb": 20})
    in_run = dataclasses.replace(shelf, memory=RunMemory(ipc, clock))
    recogniser, why = open_best(in_run, profile_with("large", "tiny"), 0)
    assert recogniser.model.manifest.name == "tiny"
    assert "needs 30 of ram_mb, but ram_mb is held by planner (20)" in why
    assert len(book.look().granted) == 2
    recogniser.close()
    assert [one.holder for one in book.look().granted] == ["planner"]


def test_with_none_the_robot_says_why_and_goes_on(shelf: ModelShelf, scripted_whisper: Any) -> None:
    (scripted_whisper.folder / "empty").mkdir(parents=True)
    profile = profile_with("empty", "missing")
    selected = select_recogniser(shelf, profile, 0)
    assert selected.recogniser is None
    absent = "{0} is not here (vla-deploy models fetch {0}, or add {0} --whisper FOLDER)"
    assert selected.why == f"{absent.format('empty')}; {absent.format('missing')}"
