"""What a scraper gets is judged by the client library's own parsers."""

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import pytest
from prometheus_client.openmetrics.parser import text_string_to_metric_families as openmetrics
from prometheus_client.parser import text_string_to_metric_families as plain_text

from vla_deploy.telemetry.metrics import METRICS, expose

if TYPE_CHECKING:
    from conftest import Robot

OPENMETRICS = "application/openmetrics-text; version=1.0.0"
Parser = Callable[[str], Iterable[Any]]
FORMATS = [("", plain_text, "text/plain"), (OPENMETRICS, openmetrics, "application/openmetrics")]


@pytest.mark.parametrize(("accept", "parse", "content_type"), FORMATS)
def test_every_metric_survives_the_parser_with_its_type(
    whole: "Robot", accept: str, parse: Parser, content_type: str
) -> None:
    text, told_type = expose(whole.read(), accept)
    assert told_type.startswith(content_type)
    families = {family.name: family for family in parse(text.decode())}
    types = {"states": "gauge", "info": "info" if accept else "gauge"}
    for metric in METRICS:
        if metric.name == "vla_gpu_load_ratio":
            continue
        name = metric.name.removesuffix("_total")
        family = families.get(name) or families[name.removesuffix("_info")]
        assert family.type == types.get(metric.kind.value, metric.kind.value)
        assert family.samples, metric.name


def test_a_histogram_has_cumulative_buckets_that_end_with_its_count(whole: "Robot") -> None:
    text = expose(whole.read())[0].decode()
    family = next(one for one in plain_text(text) if one.name == "vla_control_period_ratio")
    buckets = {
        sample.labels["le"]: sample.value
        for sample in family.samples
        if sample.name.endswith("_bucket")
    }
    assert (buckets["0.95"], buckets["1.05"], buckets["1.2"], buckets["+Inf"]) == (0, 2, 2, 3)
    rest = {sample.name.rpartition("_")[2]: sample.value for sample in family.samples}
    assert rest["count"] == 3
    assert rest["sum"] == pytest.approx(3.3)


def test_what_is_missing_has_a_series_that_says_why(robot: "Robot") -> None:
    text = expose(robot.read())[0].decode()
    assert 'vla_metric_missing{metric="vla_control_state",why="silent"} 1.0' in text
    assert "vla_control_state{" not in text


def test_label_values_with_quotes_and_line_ends_do_not_break_the_text(whole: "Robot") -> None:
    whole.write(planner_status={"by_rung": {'a "quoted"\nname\\': {"planned": 1}}})
    text = expose(whole.read())[0].decode()
    family = next(one for one in plain_text(text) if one.name == "vla_planner_rung_attempts")
    assert family.samples[0].labels["rung"] == 'a "quoted"\nname\\'
