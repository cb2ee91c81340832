"""Hold planned motions against ruckig, their limits, continuity and target."""

from typing import Any

import numpy as np
import pytest
import ruckig
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from vla_deploy.control.motion.axes import AxesState, AxisLimits, Floats
from vla_deploy.control.motion.profile_motion import MotionProfile, plan_motion, plan_stop

LIMITS = AxisLimits(
    velocity=np.array([2.0, 1.0]), acceleration=np.array([8.0, 3.0]), jerk=np.array([60.0, 40.0])
)


def state(position: Any, velocity: Any = 0.0, acceleration: Any = 0.0) -> AxesState:
    p, v, a = np.broadcast_arrays(
        np.atleast_1d(np.asarray(position, dtype=float)), velocity, acceleration
    )
    return AxesState(position=p.copy(), velocity=v.astype(float), acceleration=a.astype(float))


def single(velocity: float, acceleration: float, jerk: float) -> AxisLimits:
    return AxisLimits(
        velocity=np.array([velocity]), acceleration=np.array([acceleration]), jerk=np.array([jerk])
    )


def ruckig_duration_s(start: AxesState, target: float, limits: AxisLimits) -> float:
    problem = ruckig.InputParameter(1)
    problem.current_position = start.position.tolist()
    problem.current_velocity = start.velocity.tolist()
    problem.current_acceleration = start.acceleration.tolist()
    problem.target_position = [target]
    problem.max_velocity = limits.velocity.tolist()
    problem.max_acceleration = limits.acceleration.tolist()
    problem.max_jerk = limits.jerk.tolist()
    trajectory = ruckig.Trajectory(1)
    assert ruckig.Ruckig(1).calculate(problem, trajectory).value >= 0
    return float(trajectory.duration)


def sampled(profile: MotionProfile, count: int = 400) -> tuple[Floats, Floats, Floats, Floats]:
    times = np.linspace(0.0, profile.duration_s, count)
    samples = [profile.sample(float(t)) for t in times]
    return (
        times,
        np.array([s.position for s in samples]),
        np.array([s.velocity for s in samples]),
        np.array([s.acceleration for s in samples]),
    )


bound = st.floats(min_value=0.3, max_value=5.0)
limits_of_one = st.builds(
    single, bound, st.floats(min_value=0.5, max_value=15.0), st.floats(min_value=5.0, max_value=100)
)
distance = st.floats(min_value=-4.0, max_value=4.0).filter(lambda d: d == 0.0 or abs(d) > 1e-6)
ratio = st.floats(min_value=-0.95, max_value=0.95)


def moving_start(limits: AxisLimits, speed: float, pull: float) -> AxesState:
    start = state(0.3, speed * limits.velocity[0], pull * limits.acceleration[0])
    v, a = float(start.velocity[0]), float(start.acceleration[0])
    assume(abs(v + a * abs(a) / (2.0 * limits.jerk[0])) <= limits.velocity[0])
    return start


@given(limits_of_one, distance)
@settings(max_examples=150, deadline=None)
def test_from_rest_a_motion_takes_as_long_as_ruckigs(limits: AxisLimits, length: float) -> None:
    start = state(0.3)
    profile = plan_motion(start, np.array([0.3 + length]), limits)
    optimum_s = ruckig_duration_s(start, 0.3 + length, limits)
    assert profile.duration_s == pytest.approx(optimum_s, rel=1e-6, abs=1e-9)


def test_from_any_state_few_motions_take_noticeably_longer_than_ruckigs() -> None:
    random = np.random.default_rng(7)
    ratios: list[float] = []
    while len(ratios) < 300:
        limits = single(*random.uniform((0.5, 1.0, 5.0), (4.0, 15.0, 100.0)))
        start = state(0.0, random.uniform(-0.9, 0.9) * limits.velocity[0])
        pull = random.uniform(-0.8, 0.8) * limits.acceleration[0]
        if abs(start.velocity[0] + pull * abs(pull) / (2 * limits.jerk[0])) > limits.velocity[0]:
            continue
        start.acceleration[0] = pull
        target = random.uniform(-3.0, 3.0) * random.choice([1.0, 0.1])
        ours_s = plan_motion(start, np.array([target]), limits).duration_s
        ratios.append(ours_s / ruckig_duration_s(start, target, limits))
    assert min(ratios) > 1.0 - 1e-6
    assert np.median(ratios) < 1.0001
    assert np.quantile(ratios, 0.97) < 1.05
    assert max(ratios) < 1.4


@given(limits_of_one, distance, ratio, ratio)
@settings(max_examples=150, deadline=None)
def test_limits_are_never_exceeded(
    limits: AxisLimits, length: float, speed: float, pull: float
) -> None:
    start = moving_start(limits, speed, pull)
    _, _, velocity, acceleration = sampled(plan_motion(start, start.position + length, limits))
    assert np.abs(velocity).max() <= limits.velocity[0] * (1 + 1e-9) + 1e-9
    assert np.abs(acceleration).max() <= limits.acceleration[0] * (1 + 1e-9) + 1e-9


@given(limits_of_one, distance, ratio, ratio)
@settings(max_examples=150, deadline=None)
def test_a_motion_is_continuous_and_ends_at_rest_on_its_target(
    limits: AxisLimits, length: float, speed: float, pull: float
) -> None:
    start = moving_start(limits, speed, pull)
    profile = plan_motion(start, start.position + length, limits)
    times, position, velocity, acceleration = sampled(profile)
    step_s = times[1] - times[0]
    slack = 1e-6 + step_s * 1e-6
    assert np.abs(np.diff(acceleration[:-1, 0])).max() <= limits.jerk[0] * step_s * 1.001 + slack
    top_acceleration = limits.acceleration[0]
    assert np.abs(np.diff(velocity[:, 0])).max() <= top_acceleration * step_s * 1.001 + slack
    assert np.abs(np.diff(position[:, 0])).max() <= limits.velocity[0] * step_s * 1.001 + slack
    just_before = profile.sample(profile.duration_s * (1.0 - 1e-9))
    assert just_before.position == pytest.approx(profile.target, abs=1e-6)
    end = profile.sample(profile.duration_s)
    assert end.position == start.position + length
    assert end.velocity == end.acceleration == 0.0
    assert position[0] == pytest.approx(start.position)
    assert velocity[0] == pytest.approx(start.velocity)


def test_axes_from_rest_arrive_together_and_keep_to_a_common_shape() -> None:
    profile = plan_motion(state([0.0, 0.0]), np.array([1.5, 0.2]), LIMITS)
    before = profile.sample(profile.duration_s - 0.01)
    assert (before.velocity > 0.0).all()
    assert (before.position < profile.target).all()
    fastest = plan_motion(state([0.0]), np.array([0.2]), LIMITS.of(np.array([1])))
    assert fastest.duration_s < profile.duration_s


def test_moving_axes_arrive_together_too() -> None:
    start = state([0.0, 0.0], [0.5, -0.3], [1.0, 0.0])
    profile = plan_motion(start, np.array([2.0, 0.2]), LIMITS)
    before = profile.sample(profile.duration_s - 0.01)
    assert (np.abs(before.velocity) > 1e-6).all()


def test_axes_that_need_not_arrive_together_are_each_as_fast_as_alone() -> None:
    start, target = state([0.0, 0.0], [0.5, -0.3], [1.0, 0.0]), np.array([2.0, 0.2])
    profile = plan_motion(start, target, LIMITS, together=False)
    for axis in range(2):
        one = np.array([axis])
        alone = plan_motion(start.of(one), target[one], LIMITS.of(one))
        for at_s in np.linspace(0.0, profile.duration_s, 50):
            assert profile.sample(at_s).position[axis] == pytest.approx(
                alone.sample(at_s).position[0], abs=1e-9
            )


def test_an_axis_that_is_on_its_target_does_not_move() -> None:
    profile = plan_motion(state([0.0, 0.7]), np.array([1.0, 0.7]), LIMITS)
    _, position, velocity, _ = sampled(profile)
    assert (position[:, 1] == 0.7).all()
    assert (velocity[:, 1] == 0.0).all()


def test_a_motion_to_where_it_rests_takes_no_time() -> None:
    assert plan_motion(state([0.4]), np.array([0.4]), single(1, 1, 1)).duration_s == 0.0


def test_half_the_speed_ratio_takes_twice_the_time() -> None:
    start, target = state([0.0, 0.0]), np.array([1.5, 0.2])
    full = plan_motion(start, target, LIMITS)
    half = plan_motion(start, target, LIMITS.scaled(0.5))
    assert half.duration_s == pytest.approx(2.0 * full.duration_s)


@given(limits_of_one, ratio, ratio)
@settings(max_examples=100, deadline=None)
def test_a_stop_is_jerk_limited_and_ends_at_rest(
    limits: AxisLimits, speed: float, pull: float
) -> None:
    start = moving_start(limits, speed, pull)
    profile = plan_stop(start, limits)
    times, _, velocity, acceleration = sampled(profile)
    step_s = times[1] - times[0]
    assert np.abs(acceleration).max() <= limits.acceleration[0] * (1 + 1e-9) + 1e-9
    assert np.abs(np.diff(acceleration[:-1, 0])).max(initial=0.0) <= (
        limits.jerk[0] * step_s * 1.001 + 1e-6
    )
    assert np.abs(velocity[-2]).max() <= limits.acceleration[0] * step_s + 1e-9
    assert profile.sample(profile.duration_s + 1.0).velocity == 0.0
    just_before = profile.sample(profile.duration_s * (1.0 - 1e-9))
    assert just_before.position == pytest.approx(profile.target, abs=1e-6)


def test_a_stop_from_rest_takes_no_time() -> None:
    assert plan_stop(state([0.2]), single(1, 1, 1)).duration_s == 0.0


def test_a_start_beyond_the_limits_is_brought_back_within_them() -> None:
    limits = single(1.0, 2.0, 20.0)
    profile = plan_motion(state([0.0], 1.5, 3.0), np.array([5.0]), limits)
    late = [profile.sample(t) for t in np.linspace(1.0, profile.duration_s, 50)]
    assert max(abs(s.velocity[0]) for s in late) <= 1.0 + 1e-9
    assert profile.sample(profile.duration_s).position == 5.0


def test_a_sample_does_not_depend_on_what_was_sampled_before() -> None:
    start = state([0.0, 1.0], [0.5, 0.0])
    target = np.array([1.5, 0.2])
    used = plan_motion(start, target, LIMITS)
    times = np.linspace(0.0, used.duration_s, 60)
    rng = np.random.default_rng(0)
    for time_s in rng.permutation(times).tolist():
        fresh = plan_motion(start, target, LIMITS).sample(time_s)
        again = used.sample(time_s)
        for name in ("position", "velocity", "acceleration"):
            assert getattr(again, name).tolist() == getattr(fresh, name).tolist()
