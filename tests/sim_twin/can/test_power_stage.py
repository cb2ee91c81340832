import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_twin.can.power_stage import MotorSpec, PowerStage, ShaftEncoder, Trip

SPEC = MotorSpec()
STEP_S = 0.002


def loaded(stage: PowerStage, torque_nm: float, duration_s: float) -> PowerStage:
    for _ in range(round(duration_s / STEP_S)):
        stage.load(torque_nm, 0.0, STEP_S)
    return stage


def test_at_rest_the_current_limit_bounds_the_torque() -> None:
    assert PowerStage(SPEC).torque_range_nm(0.0) == (-4.0, 4.0)


def test_back_emf_takes_the_torque_away_up_to_the_no_load_speed() -> None:
    stage = PowerStage(SPEC)
    no_load_rad_s = SPEC.supply_v / SPEC.torque_nm_per_a
    for share in (0.85, 0.9, 0.95, 1.0):
        expected_nm = (1.0 - share) * SPEC.supply_v / SPEC.resistance_ohm * SPEC.torque_nm_per_a
        _, high_nm = stage.torque_range_nm(share * no_load_rad_s)
        assert high_nm == pytest.approx(min(4.0, expected_nm))
    assert stage.torque_range_nm(no_load_rad_s)[0] == -4.0


@given(velocity=st.floats(-1000.0, 1000.0), supply_v=st.floats(0.0, 60.0))
def test_the_range_is_never_empty_nor_above_the_limit(velocity: float, supply_v: float) -> None:
    stage = PowerStage(SPEC)
    stage.bus_v = supply_v
    low_nm, high_nm = stage.torque_range_nm(velocity)
    assert -4.0 <= low_nm <= high_nm <= 4.0


def test_a_held_load_heats_as_the_thermal_model_says() -> None:
    stage = loaded(PowerStage(SPEC), 2.0, 100.0)
    copper_w = SPEC.resistance_ohm * (2.0 / SPEC.torque_nm_per_a) ** 2
    final_k = copper_w * SPEC.thermal_resistance_k_w
    constant_s = SPEC.heat_capacity_j_k * SPEC.thermal_resistance_k_w
    expected_c = SPEC.ambient_c + final_k * (1.0 - math.exp(-100.0 / constant_s))
    assert stage.temperature_c == pytest.approx(expected_c, abs=0.01)


def test_over_temperature_trips_and_holds_until_it_has_cooled_by_the_hysteresis() -> None:
    stage = PowerStage(SPEC)
    stage.overheat()
    assert stage.trip(armed=False) is Trip.OVER_TEMPERATURE
    stage.temperature_c = SPEC.temperature_limit_c - 1.0
    assert stage.trip(armed=False) is Trip.OVER_TEMPERATURE
    stage.temperature_c = SPEC.temperature_limit_c - SPEC.temperature_hysteresis_c - 1.0
    assert stage.trip(armed=False) is None
    stage.temperature_c = SPEC.temperature_limit_c - 1.0
    assert stage.trip(armed=False) is None


def test_the_full_current_trips_by_i2t_after_its_time_and_the_continuous_one_never() -> None:
    assert loaded(PowerStage(SPEC), 4.0, SPEC.overload_s - 0.1).trip(armed=True) is None
    assert loaded(PowerStage(SPEC), 4.0, SPEC.overload_s + 0.1).trip(armed=True) is Trip.OVERLOAD
    continuous_nm = SPEC.continuous_current_a * SPEC.torque_nm_per_a
    assert loaded(PowerStage(SPEC), continuous_nm, 100.0).trip(armed=True) is None


def test_a_load_lets_the_supply_sag_and_braking_lifts_it() -> None:
    stage = PowerStage(SPEC)
    stage.load(4.0, 20.0, STEP_S)
    assert stage.bus_v < SPEC.supply_v
    stage.load(-4.0, 40.0, STEP_S)
    assert stage.bus_v > SPEC.supply_v


@pytest.mark.parametrize(
    ("supply_v", "cause"), [(15.0, Trip.UNDER_VOLTAGE), (33.0, Trip.OVER_VOLTAGE), (24.0, None)]
)
def test_a_wrong_voltage_trips_an_armed_stage(supply_v: float, cause: Trip | None) -> None:
    stage = PowerStage(SPEC)
    stage.supply(supply_v)
    assert stage.is_strained
    assert stage.trip(armed=True) is cause
    assert stage.trip(armed=False) is None


@pytest.mark.parametrize("torque_nm", [-4.0, 0.0, 4.0])
@pytest.mark.parametrize("supply_v", [15.0, 17.0, 24.0, 31.0, 33.0])
def test_a_stage_that_is_not_strained_never_trips(supply_v: float, torque_nm: float) -> None:
    stage = PowerStage(SPEC)
    stage.supply(supply_v)
    calm = 0
    for _ in range(round(30.0 / STEP_S)):
        stage.load(torque_nm, 0.0, STEP_S)
        calm += not stage.is_strained
        assert stage.is_strained or stage.trip(armed=True) is None
    assert (calm > 0) == (SPEC.under_voltage_v < supply_v < SPEC.over_voltage_v)


def test_the_encoder_counts_whole_steps_and_reads_zero_without_edges() -> None:
    encoder = ShaftEncoder(1000)
    encoder.measure(1.0, 0.0)
    encoder.measure(1.0 + 2.4 * math.tau / 1000, 0.01)
    assert encoder.travelled == 2
    assert encoder.counts_s == 0.0
    encoder.measure(1.0, 1.0)
    assert encoder.counts_s == pytest.approx(1000 / math.tau)
    encoder.frozen = True
    encoder.measure(9.0, 9.0)
    assert encoder.travelled == 0
    assert encoder.counts_s == pytest.approx(1000 / math.tau)
