"""`vla-deploy metrics`: list the metrics; print Prometheus alert rules or a Grafana dashboard."""

import argparse
import json
from collections.abc import Callable, Mapping
from typing import Any, Final

import yaml

from vla_deploy.cli.commands import add_top_command
from vla_deploy.telemetry.metrics import METRICS
from vla_deploy.telemetry.metrics.grafana import grafana_dashboard
from vla_deploy.telemetry.metrics.prometheus import alert_rules

_EXAMPLES: Final = "  vla-deploy metrics\n  vla-deploy metrics rules > vla-deploy-rules.yml\n"


def register(commands: Any) -> None:
    """Add the command."""
    metrics = add_top_command(commands, "metrics", _EXAMPLES, run)
    metrics.add_argument("what", nargs="?", choices=sorted(_OUTPUTS), default="list")


def run(arguments: argparse.Namespace) -> int:
    """Print the list, the rules or the dashboard."""
    print(_OUTPUTS[arguments.what]().rstrip("\n"))
    return 0


def _list() -> str:
    return "\n".join(
        f"{metric.name}{{{', '.join(metric.labels)}}} {metric.kind.value}: {metric.help}"
        for metric in METRICS
    )


_OUTPUTS: Final[Mapping[str, Callable[[], str]]] = {
    "list": _list,
    "rules": lambda: str(yaml.safe_dump(alert_rules(), sort_keys=False, width=1000)),
    "grafana": lambda: json.dumps(grafana_dashboard(), indent=1),
}
