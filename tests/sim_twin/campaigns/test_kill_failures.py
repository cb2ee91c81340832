"""What follows a kill too late, or not at all, is a failure; what is in time is none."""

from sim_twin.campaigns.killing.failures import late, late_ready


def test_what_is_in_time_is_no_failure() -> None:
    assert not list(late(1.5, 1.5, "")) + list(late(None, 9.0, "")) + list(late_ready(30.0, 30.0))


def test_what_never_came_is_late() -> None:
    assert "inf" in next(late(1.5, float("inf"), "left_wheel"))
    assert "inf" in next(late_ready(30.0, float("inf")))
