from benchmarks.scan_matching import FAILED_M, measure


def test_scans_are_fitted_to_the_map_from_wrong_guesses() -> None:
    report = measure(places=4)
    assert report["own"]["median_m"] < FAILED_M / 2
    assert report["own"]["cpu_ms"] > 0.0
