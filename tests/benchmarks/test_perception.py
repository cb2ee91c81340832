import json
from importlib import import_module

import pytest

from benchmarks.perception import PARTS, main, measure


@pytest.mark.gl
def test_the_network_is_judged_on_fresh_images_and_timed_beside_its_original(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["--json", "--part", "network", "--images", "6", "--scenes", "2"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["parts"] == ["network"]
    assert (report["images"], report["provider"]) == (6, "CPUExecutionProvider")
    assert report["labels"] > 0
    assert 0.0 < report["map50_int8"] <= 1.0
    assert report["map50_int8"] == pytest.approx(report["map50_fp32"], abs=0.15)
    assert report["int8_speedup"] > 0.0
    assert report["named_things"] >= 1


@pytest.mark.slow
@pytest.mark.stack
@pytest.mark.timeout(300)
def test_the_real_process_is_measured_while_the_robot_works() -> None:
    report = measure(["live"], {"live": {"seconds": 15.0}})
    assert report["looks"] >= 10
    assert 0.0 < report["frame_to_object_median_s"] <= report["frame_to_object_p95_s"]
    assert 0.0 < report["cpu_used_of_budget"] < 1.0
    assert report["names_by"] == "network"


@pytest.mark.parametrize("part", PARTS)
def test_every_part_is_a_module_with_a_measure(part: str) -> None:
    assert callable(import_module(f"benchmarks.perception_{part}").measure)
