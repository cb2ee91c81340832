"""Read the plans of language models and older tools, and say what of them is not used."""

from vla_deploy.plans.dialects.context import is_context, read_context
from vla_deploy.plans.dialects.document import LISTS
from vla_deploy.plans.dialects.findings import PlanNote
from vla_deploy.plans.dialects.reading import PlanReading, parse_plan, read_plan
from vla_deploy.plans.dialects.values import Json

__all__ = [
    "LISTS",
    "Json",
    "PlanNote",
    "PlanReading",
    "is_context",
    "parse_plan",
    "read_context",
    "read_plan",
]
