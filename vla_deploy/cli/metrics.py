"""`vla-deploy metrics`: list what is measured; print what Prometheus and Grafana need for it."""

import argparse
import json
from collections.abc import Callable, Mapping
from typing import Any, Final

import yaml

from vla_deploy.cli.example import add_top_command
from vla_deploy.telemetry.metrics import METRICS
from vla_deploy.telemetry.metrics.grafana import grafana_dashboard
from vla_deploy.telemetry.metrics.prometheus import alert_rules

_EXAMPLES: Final = "  vla-deploy metrics\n  vla-deploy metrics rules > vla-deploy-rules.yml\n"


def register(commands: Any) -> None:
    """Add the command."""
    metrics = add_top_command(commands, "metrics", _EXAMPLES)
    metrics.add_argument("what", nargs="?", choices=sorted(_WAYS), default="list")
    metrics.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Print what is asked for."""
    print(_WAYS[arguments.what]().rstrip("\n"))
    return 0


def _list() -> str:
    return "\n".join(
        f"{metric.name}{{{', '.join(metric.labels)}}} {metric.kind.value}: {metric.help}"
        for metric in METRICS
    )


def _rules() -> str:
    text: str = yaml.safe_dump(alert_rules(), sort_keys=False, width=1000)
    return text


def _grafana() -> str:
    return json.dumps(grafana_dashboard(), indent=1)


_WAYS: Final[Mapping[str, Callable[[], str]]] = {
    "list": _list,
    "rules": _rules,
    "grafana": _grafana,
}
