import json

import pytest

from benchmarks.estop import main, standstill_s
from sim_twin.campaigns.faulting.phases import Phase


def test_a_resting_robot_stands_at_once_and_a_driving_one_soon() -> None:
    resting_s, driving_s = standstill_s(Phase.IDLE), standstill_s(Phase.DRIVING)
    assert resting_s < driving_s < 1.0


@pytest.mark.slow
@pytest.mark.stack
@pytest.mark.timeout(180)
def test_each_request_reaches_the_wire_and_each_phase_comes_to_rest(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["--json", "--requests", "5"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["requests"] + report["stopped_before_request"] == 5
    assert 0.0 < report["request_to_frame_ticks_median"] <= report["request_to_frame_ticks_max"]
    assert all(report[f"standstill_s_{phase.value}"] > 0.0 for phase in Phase)
