"""Write the model's card and manifest from what was measured."""

import json
from pathlib import Path
from string import Template
from typing import Any, Final

from training.planner.evaluation import MOST_TOKENS
from training.planner.files import CARD, GRAPH, MEAN_OF, METRICS, NAME, PARTS
from training.planner.sentences.clause import load_groups
from training.planner.sentences.telling import AFTER, BEFORE, KEPT_BACK_OF, load_remarks, load_told
from training.planner.settings import PlannerSettings
from vla_deploy.inference.manifest import Certainty, Language, LanguageUse, Manifest, ModelFile
from vla_deploy.inference.manifest_file import write_manifest
from vla_deploy.inference.store import sha256_of

TEMPLATE: Final = Path(__file__).with_name("card_template.md")
SUMMARY: Final = "Tells what a household command says: steps, and the words for things and places"
_TITLES: Final = {
    "seen_phrases": "new sentences of the phrases that it learnt",
    "kept_back_phrases": "phrases kept back from it",
    "other_talk": "other talk, none of it seen",
}


def describe(
    models: Path, settings: PlannerSettings, has_chatter: bool, start_from: Path | None = None
) -> None:
    """Write `card.md` and `model.toml` beside the files that they describe.

    Raises:
        FileNotFoundError: the model or its metrics are not there.
    """
    metrics = json.loads((models / METRICS).read_text(encoding="utf-8"))
    text = card(metrics, models, settings, has_chatter, is_begun=start_from is not None)
    (models / CARD).write_text(text, encoding="utf-8")
    write_manifest(models, manifest(metrics, models))


def manifest(metrics: dict[str, Any], models: Path) -> Manifest:
    """Return the manifest that the robot reads."""
    return Manifest(
        name=NAME,
        role="planner",
        summary=SUMMARY,
        licence="Apache-2.0",
        card=CARD,
        parts=tuple(ModelFile(path=name, sha256=sha256_of(models / name)) for name in PARTS),
        language=Language(
            use=LanguageUse.COMMAND_PARSER,
            most_tokens=MOST_TOKENS,
            certainty=Certainty(**metrics["certainty"]),
        ),
    )


def card(
    metrics: dict[str, Any],
    models: Path,
    settings: PlannerSettings,
    has_chatter: bool,
    *,
    is_begun: bool = False,
) -> str:
    """Return the model card."""
    shape = settings.shape
    values = {
        "table": table(metrics),
        "size_mb": f"{(models / GRAPH).stat().st_size / 2**20:.1f}",
        "width": shape.width,
        "layers": shape.layers,
        "heads": shape.heads,
        "vocabulary": shape.vocabulary,
        "phrases": _count(held_out=False),
        "kept_back": _count(held_out=True),
        "told": len(load_told(held_out=False)),
        "remarks": sum(len(load_remarks(one, held_out=False)) for one in (BEFORE, AFTER)),
        "kept_back_of": KEPT_BACK_OF,
        "other_talk": _TALK if has_chatter else "The other talk is that of the same lists.",
        "read_back_below": metrics["certainty"]["read_back_below"],
        "decline_below": metrics["certainty"]["decline_below"],
        "p50_ms": f"{1000 * metrics['took_p50_s']:.0f}",
        "p95_ms": f"{1000 * metrics['took_p95_s']:.0f}",
        "size": settings.name,
        "more": " --start-from EARLIER" if is_begun else "",
        "began": (f" {_BEGAN}" if is_begun else "") + _mean_of(models.parent / MEAN_OF),
        "seed": settings.seed,
    }
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(values)


def _mean_of(told: Path) -> str:
    return f" {told.read_text(encoding='utf-8')}" if told.exists() else ""


def table(metrics: dict[str, Any]) -> str:
    """Return the figures of each set as rows."""
    rows = []
    for name, told in metrics["sets"].items():
        shares = " | ".join(
            f"{100 * told[key]:.1f} %" for key in ("right", "acted", "read_back", "wrong_unasked")
        )
        rows.append(f"| {_TITLES[name]} | {told['count']} | {shares} |")
    return "\n".join(rows)


def _count(held_out: bool) -> int:
    groups = [one for every in load_groups(held_out).values() for one in every]
    return sum(len(one.imperative) + len(one.free) for one in groups)


_BEGAN: Final = "It began with the weights of an earlier training."
_TALK: Final = (
    "Sixty percent of the other talk are sentences of CLINC150 (Larson et al., 2019, CC BY 3.0), "
    "without those near a command."
)
