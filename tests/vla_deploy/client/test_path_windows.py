"""Windows cover a path without a gap, pass each frame on time, and end at rest on it."""

import itertools

import numpy as np
import pytest

from vla_deploy.client.path_windows import LEAD_S, TimedPath, windows_of

MAX_POINTS = 256  # what control takes


def path_of(frames: int, frames_per_s: float) -> TimedPath:
    positions = np.stack([np.arange(frames), -np.arange(frames)], axis=1) * 0.01
    return TimedPath(joints=("a", "b"), positions=positions, frames_per_s=frames_per_s)


@pytest.mark.parametrize("frames", [2, 3, 10, 75, 200, 1000])
@pytest.mark.parametrize("rate", [0.3, 5.0, 25.0, 30.0, 60.0])
def test_windows_follow_each_other_to_the_end_of_the_path(frames: int, rate: float) -> None:
    windows = windows_of(path_of(frames, rate))
    assert windows[0].begins == 0
    assert windows[-1].ends == frames - 1
    assert [one.from_rest for one in windows] == [True] + [False] * (len(windows) - 1)
    for one, following in itertools.pairwise(windows):
        assert one.begins < following.begins < one.brakes < one.ends
        assert following.brakes >= following.begins
    for one in windows:
        assert one.begins <= one.brakes < one.ends
        assert len(one.times_s) == one.ends - one.begins + 1 < MAX_POINTS
        step_s = np.diff(one.times_s)
        assert (step_s >= 1 / rate - 1e-9).all()  # never faster than the path
        assert one.times_s[0] == 0.0
        steady = one.brakes - max(one.begins + (one.ends - one.brakes), one.begins)
        if not one.from_rest and steady > 0:
            np.testing.assert_allclose(step_s[: one.brakes - one.begins], 1 / rate)
        middle = (one.begins + one.ends) / 2
        assert one.frame_at(one.time_at(middle)) == pytest.approx(middle)


def test_a_window_that_takes_over_goes_on_where_the_one_before_is() -> None:
    first, second = windows_of(path_of(200, 30.0))[:2]
    frame = second.begins + 1.7
    times_s, positions = second.trajectory(frame)
    assert times_s[0] >= LEAD_S - 1e-9
    number = round(positions[0, 0] / 0.01)
    assert times_s[0] == pytest.approx((number - frame) / 30.0)
    assert first.time_at(number) - first.time_at(frame) == pytest.approx(times_s[0])
    times_s, positions = first.trajectory()
    assert (times_s[0], positions[0, 0]) == (0.0, 0.0)


def test_a_path_of_many_frames_a_second_is_thinned_but_ends_where_it_ended() -> None:
    path = path_of(1000, 240.0).thinned()
    assert path.frames_per_s == 60.0
    assert path.positions[-1, 0] == pytest.approx(9.99)
    assert len(path.positions) == 250
    assert not windows_of(path_of(1, 30.0))
