"""A servo that stays silent is taken out of the block read; no other is."""

from drivers.dynamixel.roster import SUSPEND_AFTER, Roster


def test_a_servo_is_suspended_after_misses_in_a_row() -> None:
    roster = Roster(4)
    for _ in range(SUSPEND_AFTER - 1):
        assert roster.note_missing([2]) == ()
    assert roster.note_missing([2]) == (2,)
    assert roster.polled == (0, 1, 3)
    assert roster.suspended == (2,)


def test_misses_that_are_not_in_a_row_are_forgiven() -> None:
    roster = Roster(4)
    for _ in range(10):
        assert roster.note_missing([2]) == ()
        roster.note_complete()
    assert roster.suspended == ()


def test_only_who_is_blamed_every_time_is_suspended() -> None:
    roster = Roster(4)
    for other in (0, 2, 3):
        dropped = roster.note_missing([1, other])
    assert dropped == (1,)
    assert roster.polled == (0, 2, 3)


def test_at_least_one_servo_is_always_polled() -> None:
    roster = Roster(2)
    for _ in range(10):
        assert roster.note_missing([0, 1]) == ()
    assert roster.polled == (0, 1)


def test_a_resumed_servo_starts_with_a_clean_slate() -> None:
    roster = Roster(3)
    for _ in range(SUSPEND_AFTER):
        roster.note_missing([1])
    roster.resume(1)
    assert roster.polled == (0, 1, 2)
    assert roster.note_missing([1]) == ()


def test_the_last_servo_stays() -> None:
    roster = Roster(1)
    roster.suspend(0)
    assert roster.polled == (0,)
