from vla_deploy.control.reporting.status_pace import LEAST_GAP_TICKS, StatusPace

EVERY = 12


def told(changes: dict[int, str], ticks: int) -> list[int]:
    pace, matters, due = StatusPace(), "", []
    for tick in range(ticks):
        matters = changes.get(tick, matters)
        if pace.is_due(tick, matters, EVERY):
            due.append(tick)
    return due


def test_what_does_not_change_is_told_every_so_often() -> None:
    assert told({}, 30) == [0, EVERY, 2 * EVERY]


def test_a_change_is_told_at_once_and_the_next_one_when_it_may() -> None:
    assert told({20: "stopping"}, 30) == [0, 12, 20]
    assert told({20: "stopping", 21: "stopped"}, 28) == [0, 12, 20, 20 + LEAST_GAP_TICKS]


def test_a_change_that_is_taken_back_before_it_could_be_told_is_none() -> None:
    assert told({13: "a", 15: ""}, 24) == [0, 12]


def test_the_rate_may_change_between_two_ticks() -> None:
    pace = StatusPace()
    assert pace.is_due(0, "", EVERY)
    assert not pace.is_due(4, "", EVERY)
    assert pace.is_due(4, "", 4)
