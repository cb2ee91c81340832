"""The corpora are data that people edit: each line must mean something."""

import json
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from benchmarks import planner_corpus
from benchmarks.planner_corpus import (
    COMMAND_CORPORA,
    PLAN,
    CorpusUnreadable,
    attacks,
    command_kinds,
    commands,
    home,
    other_talk,
    scenes,
)
from benchmarks.planner_told import executor_document, scene_document
from vla_deploy.world import read_snapshot

TELLING_WORDS = 7


def test_there_are_enough_commands_of_each_kind_and_nothing_is_said_twice() -> None:
    cases = commands()
    assert len(command_kinds()) >= 10
    assert sum(PLAN in case.turns[-1].must for case in cases) >= 150
    assert min(Counter(case.kind for case in cases).values()) >= 20
    twice = Counter((case.scene, *(turn.say for turn in case.turns)) for case in cases)
    assert twice.most_common(1)[0][1] == 1


def test_there_are_enough_sentences_of_other_talk_and_attacks() -> None:
    assert len(set(other_talk())) == len(other_talk()) >= 200
    assert len(attacks()) >= 100


def test_nothing_was_tuned_to_the_corpora() -> None:
    """No longer sentence of theirs stands in the robot's code, its prompts or its training."""
    root = Path(planner_corpus.__file__).parents[1]
    files = [
        path
        for folder in ("vla_deploy", "training")
        for path in (root / folder).rglob("*")
        if path.suffix in {".py", ".md", ".toml", ".txt", ".jsonl"}
    ]
    written = "\n".join(path.read_text(encoding="utf-8", errors="ignore") for path in files).lower()
    unseen = [one for name in COMMAND_CORPORA for one in commands(corpus=name)]
    said = [turn.say for case in unseen for turn in case.turns] + other_talk()
    sentences = {text.lower().strip(".?! ") for text in said if len(text.split()) >= TELLING_WORDS}
    assert sorted(text for text in sentences if text in written) == []


@pytest.mark.parametrize("corpus", COMMAND_CORPORA)
def test_no_goal_is_reached_by_doing_nothing(corpus: str) -> None:
    for case in commands(corpus=corpus):
        start = scenes()[case.scene].world(home())
        goal = case.turns[0].goal
        if goal is not None and "still" not in goal.text:
            assert goal.missed(start, start), case.name


@pytest.mark.parametrize("name", sorted(scenes()))
def test_every_scene_can_be_told_to_the_robot(name: str) -> None:
    flat = scenes()[name].world(home())
    told = read_snapshot(scene_document(flat, 10**9))
    seen = {one.thing_id for one in flat.things.values() if one.is_seen}
    assert {one.thing_id for one in told.things} == seen
    held = {one.thing_id: one.held_by for one in told.things if one.held_by}
    holding = executor_document(flat)["holding"]
    assert {flat.things[one].kind for one in held} == {kind for kind in holding.values() if kind}


@pytest.mark.parametrize(
    "line",
    [
        {"say": "go", "goal": "at kitchen", "scene": "nowhere"},
        {"say": "go"},
        {"say": "go", "must": "guess"},
        {"say": "take it", "goal": "held cup_9"},
    ],
)
def test_a_line_that_means_nothing_is_named(
    line: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenes()
    (tmp_path / "judging").mkdir()
    (tmp_path / "judging" / "odd.jsonl").write_text(json.dumps(line))
    monkeypatch.setattr(planner_corpus, "CORPORA", tmp_path)
    with pytest.raises(CorpusUnreadable, match=r"odd\.jsonl, line 1"):
        commands()
