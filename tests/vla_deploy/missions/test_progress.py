"""How far a mission is: order, failure, loss, repetition, and what a file keeps of it."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vla_deploy.missions.errors import MissionsUnusable
from vla_deploy.missions.mission import read_mission
from vla_deploy.missions.progress import MissionRun, MissionState, PartState
from vla_deploy.missions.store import MOST_KEPT, MissionStore, newest


def begun(document: object, **given: object) -> MissionRun:
    run = MissionRun(mission_id="c1", mission=read_mission(document), given_unix_s=0.0, **given)  # type: ignore[arg-type]
    run.begin(0.0)
    return run


def ready(run: MissionRun) -> list[str]:
    return [name for name, _ in run.ready()]


def do(run: MissionRun, name: str, error: str = "", **how: bool) -> None:
    run.start(name, 1.0)
    run.end(name, 2.0, error, **how)
    while checked := run.checking():
        run.conclude(checked[0][0], 3.0)


CHAIN = [
    {"id": "late", "words": "w", "priority": 9},
    {"id": "soon", "words": "w", "priority": 1},
    {"id": "then", "words": "w", "priority": 0, "depends_on": ["soon"]},
    {"id": "two", "subtasks": [{"words": "w"}, {"words": "w", "dependencies": ["s1"]}]},
]


def test_dependencies_come_first_and_priority_second() -> None:
    run = begun(CHAIN)
    assert ready(run) == ["soon.s1", "two.s1", "late.s1"]
    do(run, "soon.s1")
    assert ready(run) == ["then.s1", "two.s1", "late.s1"]
    for name in ("then.s1", "two.s1", "two.s2", "late.s1"):
        assert name in ready(run)
        do(run, name)
    assert run.settle()
    assert run.state is MissionState.COMPLETED
    assert run.report().startswith("4 of 4 objectives done")


def test_what_depends_on_a_failure_is_cancelled_and_the_rest_is_done() -> None:
    run = begun(CHAIN)
    do(run, "soon.s1", "it is gone")
    assert run.objectives["then"].state is PartState.CANCELLED
    assert ready(run) == ["two.s1", "late.s1"]
    for name in ("two.s1", "two.s2", "late.s1"):
        do(run, name)
    assert run.settle()
    assert run.state is MissionState.FAILED
    assert "2 of 4 objectives done" in run.report()
    assert "failed: it is gone" in run.report()


def test_what_was_lost_is_tried_once_more() -> None:
    run = begun(["w"])
    for tries in (1, 2):
        assert ready(run) == ["o1.s1"]
        do(run, "o1.s1", "lost: the executor ended", is_lost=True)
        assert run.subtasks["o1.s1"].tries == tries
    assert run.settle()
    assert run.state is MissionState.FAILED


def test_a_mission_repeats_as_often_as_it_should() -> None:
    run = begun({"objectives": ["w"], "schedule": {"every_s": 60.0, "times": 2}})
    do(run, "o1.s1")
    assert (run.settle(), run.repeats(), run.due_unix_s) == (True, True, 60.0)
    run.begin(60.0)
    do(run, "o1.s1")
    assert (run.settle(), run.repeats()) == (True, False)


@given(st.data())
def test_whatever_happens_a_mission_comes_to_an_end_that_is_told(data) -> None:
    names = [f"o{number}" for number in range(5)]
    objectives = [
        {
            "id": name,
            "words": "w",
            "priority": data.draw(st.integers(-3, 3)),
            "depends_on": sorted(data.draw(st.sets(st.sampled_from(names[:place] or ["o0"]))))
            if place
            else [],
        }
        for place, name in enumerate(names)
    ]
    run = begun(objectives)
    for _ in range(20):
        if not ready(run):
            break
        lost = data.draw(st.booleans())
        do(run, ready(run)[0], "lost" if lost else data.draw(st.sampled_from(["", "no"])),
           is_lost=lost)  # fmt: skip
    assert run.settle()
    states = {one.state for one in run.objectives.values()}
    assert (run.state is MissionState.COMPLETED) == (states == {PartState.COMPLETED})
    assert run.report()


def test_a_file_keeps_the_newest_and_all_that_have_not_ended(tmp_path) -> None:
    store = MissionStore(tmp_path / "deep" / "missions.json")
    runs = [begun([f"w {number}"]) for number in range(MOST_KEPT + 5)]
    for number, run in enumerate(runs):
        run.mission_id = f"c{number}"
        if number:
            run.cancel("enough", 1.0)
    store.save(newest(runs))
    assert [one.mission_id for one in store.load()] == ["c0", *(f"c{n}" for n in range(6, 25))]
    assert store.load()[0] == runs[0]


@pytest.mark.parametrize("text", ["", "{", "[7]", '[{"mission_id": 1}]', "[" * 100_000, "null"])
def test_a_file_that_holds_something_else_is_named_and_not_lost(tmp_path, text) -> None:
    store = MissionStore(tmp_path / "missions.json")
    assert store.file is not None
    store.file.write_text(text)
    with pytest.raises(MissionsUnusable, match=r"missions\.json does not hold missions"):
        store.load()
    store.keep_unreadable()
    assert (tmp_path / "missions.unreadable").read_text() == text
    assert store.load() == []
    store.save([begun(["w"])])
    assert json.loads(store.file.read_text())[0]["mission_id"] == "c1"
