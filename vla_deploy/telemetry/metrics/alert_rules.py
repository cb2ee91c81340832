"""Write the alert rules for Prometheus from the table of conditions."""

from typing import Any, Final

from vla_deploy.telemetry.metrics.conditions import CONDITIONS, Condition
from vla_deploy.telemetry.metrics.exposition import MISSING
from vla_deploy.telemetry.metrics.kinds import Why

JOB: Final = "vla_deploy"
_GROUP: Final = "vla_deploy"
_VITAL: Final = "vla_control_state|vla_process_state"


def alert_rules() -> dict[str, Any]:
    """Return the rule file as plain data."""
    rules = [_DOWN, _SILENT, *(_rule(condition) for condition in CONDITIONS)]
    return {"groups": [{"name": _GROUP, "rules": rules}]}


def expression(condition: Condition) -> str:
    """Return the condition in PromQL."""
    chosen = condition.metric + _selector(condition)
    if condition.per_s:
        chosen = f"rate({chosen}[{condition.per_s}s])"
    if condition.of:
        chosen += f" / rate({condition.of}[{condition.per_s}s])"
    if condition.above is not None:
        return f"{chosen} > {condition.above:g}"
    return f"{chosen} < {condition.below:g}"


def _selector(condition: Condition) -> str:
    inside = ",".join(f'{label}=~"{"|".join(of)}"' for label, of in condition.where.items())
    return f"{{{inside}}}" if inside else ""


def _rule(condition: Condition) -> dict[str, Any]:
    return {
        "alert": condition.name,
        "expr": expression(condition),
        "for": f"{condition.for_s}s",
        "labels": {"severity": condition.severity.name.lower()},
        "annotations": {"summary": condition.summary, "description": condition.remedy},
    }


_DOWN: Final = {
    "alert": "VlaRobotUnreachable",
    "expr": f'up{{job="{JOB}"}} == 0',
    "for": "30s",
    "labels": {"severity": "critical"},
    "annotations": {
        "summary": "The robot's dashboard cannot be scraped.",
        "description": "Is the robot switched on, and the token valid? vla-deploy status",
    },
}
_SILENT: Final = {
    "alert": "VlaProcessSilent",
    "expr": f'{MISSING}{{metric=~"{_VITAL}",why="{Why.SILENT.value}"}} == 1',
    "for": "10s",
    "labels": {"severity": "critical"},
    "annotations": {
        "summary": "Control or the supervisor tells nothing.",
        "description": "vla-deploy status; vla-deploy logs",
    },
}
