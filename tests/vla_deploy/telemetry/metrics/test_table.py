"""The table keeps the field's conventions, as promtool's checks do."""

import re

from vla_deploy.ipc import BY_NAME
from vla_deploy.speech.verdict import PhraseVerdict
from vla_deploy.telemetry.metrics import METRICS, METRICS_BY_NAME, Metric, MetricKind
from vla_deploy.telemetry.metrics.model_metrics import VERDICTS
from vla_deploy.telemetry.metrics.paths import labels_of
from vla_deploy.telemetry.metrics.table import OWN, PULSES

BASE_UNITS = {
    *("seconds", "bytes", "ratio", "celsius", "watts", "volts", "hertz", "cores", "rpm"),
    *("meters_per_second", "radians_per_second"),
}
RESERVED = {"le", "quantile", "job", "instance", "__name__"}


def test_names_units_and_help_follow_the_conventions() -> None:
    for metric in METRICS:
        judge_name(metric)


def judge_name(metric: Metric) -> None:
    assert re.fullmatch(r"vla_[a-z][a-z0-9]*(_[a-z0-9]+)*", metric.name)
    assert metric.name.endswith("_total") == (metric.kind is MetricKind.COUNTER)
    assert metric.name.endswith("_info") == (metric.kind is MetricKind.INFO)
    assert metric.unit in BASE_UNITS | {""}
    assert metric.name.removesuffix("_total").endswith(metric.unit)
    assert not re.search(r"_(ms|mb|s|c|w|hz|percent|count|sum|bucket|gauge)(_|$)", metric.name)
    assert re.fullmatch(r"[A-Z0-9].*[^.]\.", metric.help)


def test_all_ways_to_a_metric_name_the_same_labels() -> None:
    for metric in METRICS:
        assert len({labels_of(path) for path in metric.paths}) == 1, metric.name
        assert not RESERVED & set(metric.labels), metric.name
        assert all(re.fullmatch(r"[a-z_]+", label) for label in metric.labels), metric.name
        assert bool(metric.states) == (metric.kind is MetricKind.STATES), metric.name


def test_no_name_is_declared_twice_and_every_topic_is_known() -> None:
    assert len(METRICS_BY_NAME) == len(METRICS)
    assert {metric.topic for metric in METRICS} <= {*BY_NAME, PULSES, OWN}


def test_a_histogram_and_states_do_not_go_to_the_history_as_they_are() -> None:
    kept = {metric.kind for metric in METRICS if metric.kept}
    assert kept == {MetricKind.GAUGE, MetricKind.COUNTER}


def test_the_verdicts_on_phrases_are_those_of_speech() -> None:
    assert set(VERDICTS) == {str(verdict) for verdict in PhraseVerdict}
