import json
from pathlib import Path

from vla_deploy.planning.plan import Plan, plan_schema

PUBLISHED = Path(__file__).parents[3] / "docs" / "plan.schema.json"


def test_the_published_schema_is_the_one_in_force() -> None:
    """Mend with: vla-deploy schema > docs/plan.schema.json."""
    assert json.loads(PUBLISHED.read_text(encoding="utf-8")) == plan_schema()


def test_the_example_in_the_documentation_is_a_plan() -> None:
    text = (PUBLISHED.parent / "plans.md").read_text(encoding="utf-8")
    example = text.split("```json\n")[1].split("```")[0]
    assert len(Plan.model_validate_json(example).actions) == 3
