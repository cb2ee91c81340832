"""What is shipped for Prometheus and Grafana refers only to metrics that exist, and is current."""

import json
import re
from pathlib import Path
from typing import Any

import yaml

from vla_deploy.telemetry.metrics import METRICS, METRICS_BY_NAME, MetricKind
from vla_deploy.telemetry.metrics.conditions import CONDITIONS
from vla_deploy.telemetry.metrics.grafana import grafana_dashboard
from vla_deploy.telemetry.metrics.prometheus import MISSING, alert_rules

SHIPPED = Path(__file__).parents[4] / "docs" / "monitoring"
WORDS = {"rate", "sum", "by", "histogram_quantile", "le", "up", "job", "instance", "metric", "why"}


def judge(expression: str) -> None:
    """Find every name in an expression: metrics must exist, and labels be those of theirs."""
    bare = re.sub(r'"[^"]*"|\[[^]]*\]', "", expression)
    names = set(re.findall(r"[a-z_][a-z_0-9]*", bare)) - WORDS
    metrics = {name for name in names if name.startswith("vla_")} - {MISSING}
    known = {name.removesuffix("_bucket") for name in metrics}
    assert known <= set(METRICS_BY_NAME), expression
    labels = {label for name in known for label in METRICS_BY_NAME[name].labels}
    assert names - metrics - {MISSING} <= labels, expression
    assert all(METRICS_BY_NAME[name].kind is MetricKind.COUNTER for name in rated(expression))


def rated(expression: str) -> set[str]:
    found = set(re.findall(r"rate\((vla_[a-z0-9_]+)", expression))
    return {name for name in found if not name.endswith("_bucket")}


def test_every_alert_refers_to_metrics_and_states_that_exist() -> None:
    (group,) = alert_rules()["groups"]
    for rule in group["rules"]:
        judge(rule["expr"])
        assert rule["annotations"]["summary"].endswith(".")
    for condition in CONDITIONS:
        metric = condition.declared
        assert (condition.above is None) != (condition.below is None)
        for label, values in condition.where.items():
            assert label in metric.labels
            if label == metric.state_label and metric.states:
                assert set(values) <= set(metric.states)
    names = [condition.name for condition in CONDITIONS]
    assert len(set(names)) == len(names)


def test_every_panel_refers_to_a_metric_and_every_metric_has_one() -> None:
    panels: list[dict[str, Any]] = grafana_dashboard()["panels"]
    asked = [target["expr"] for panel in panels for target in panel.get("targets", ())]
    for expression in asked:
        judge(expression)
    shown = " ".join(asked)
    assert all(one.name in shown for one in METRICS if one.kind is not MetricKind.INFO)
    places = [tuple(panel["gridPos"][key] for key in "xy") for panel in panels]
    assert len(set(places)) == len(places) == len({panel["id"] for panel in panels})


def test_the_shipped_files_are_what_the_table_says() -> None:
    told = "write it anew: vla-deploy metrics"
    rules = yaml.safe_load((SHIPPED / "prometheus-rules.yml").read_text())
    assert rules == alert_rules(), f"{told} rules"
    dashboard = json.loads((SHIPPED / "grafana-dashboard.json").read_text())
    assert dashboard == grafana_dashboard(), f"{told} grafana"
