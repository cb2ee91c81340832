import json
from pathlib import Path

from vla_deploy.analysis.document import SceneAnalysis, analysis_schema

PUBLISHED = Path(__file__).parents[3] / "docs" / "analysis.schema.json"


def test_the_published_schema_is_the_one_in_force():
    """Mend with: vla-deploy schema analysis > docs/analysis.schema.json."""
    assert json.loads(PUBLISHED.read_text(encoding="utf-8")) == analysis_schema()


def test_an_analysis_has_no_field_that_could_be_an_action():
    """An analysis is advice: what names steps to do would be a plan, and plans are validated."""
    text = json.dumps(analysis_schema()).lower()
    assert not {word for word in ("action", "command", "skill", "motion") if f'"{word}' in text}


def test_the_example_in_the_documentation_is_an_analysis():
    text = (PUBLISHED.parent / "world-model.md").read_text(encoding="utf-8")
    example = text.split("```json\n")[1].split("```")[0]
    assert SceneAnalysis.model_validate_json(example).task is not None
