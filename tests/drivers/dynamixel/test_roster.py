"""A servo that stays silent is taken out of the block read; nobody else is."""

from drivers.dynamixel.roster import SUSPEND_AFTER, Roster


def test_a_servo_is_suspended_after_misses_in_a_row() -> None:
    roster = Roster(4)
    for _ in range(SUSPEND_AFTER - 1):
        assert roster.note_partial({0, 1, 3}, chained=False) == ()
    assert roster.note_partial({0, 1, 3}, chained=False) == (2,)
    assert roster.polled == (0, 1, 3)
    assert roster.suspended == (2,)


def test_misses_that_are_not_in_a_row_are_forgiven() -> None:
    roster = Roster(4)
    for _ in range(10):
        assert roster.note_partial({0, 1, 3}, chained=False) == ()
        roster.note_complete()
    assert roster.suspended == ()


def test_in_a_chained_reply_only_the_first_missing_is_blamed() -> None:
    roster = Roster(4)
    for _ in range(SUSPEND_AFTER):
        dropped = roster.note_partial({0}, chained=True)
    assert dropped == (1,)
    assert roster.polled == (0, 2, 3)


def test_nobody_is_blamed_when_all_are_silent() -> None:
    roster = Roster(4)
    for _ in range(10):
        assert roster.note_partial(set(), chained=False) == ()
    assert roster.suspended == ()


def test_a_resumed_servo_starts_with_a_clean_slate() -> None:
    roster = Roster(3)
    for _ in range(SUSPEND_AFTER):
        roster.note_partial({0, 2}, chained=False)
    roster.resume(1)
    assert roster.polled == (0, 1, 2)
    assert roster.note_partial({0, 2}, chained=False) == ()


def test_the_last_servo_stays() -> None:
    roster = Roster(1)
    roster.suspend(0)
    assert roster.polled == (0,)
