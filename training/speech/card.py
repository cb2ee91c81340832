"""Write the model's card from what was measured."""

import json
from pathlib import Path
from string import Template
from typing import Any, Final

from training.speech.sizes import TrainingSize
from training.voices import kokoro
from training.voices.cast import (
    ACCENTS,
    HELD_OUT_ACCENT,
    HELD_OUT_VARIANTS,
    PACKAGED_VOICES,
    ROBOTIC_VARIANTS,
    VARIANTS,
)

METRICS: Final = "metrics.json"
TRAINING: Final = "training.json"
"""What a training cost."""
TEMPLATE: Final = Path(__file__).with_name("card_template.md")
AIMS: Final = {
    "wer_held_out_voices": 0.02,
    "wer_held_out_voices_10db": 0.05,
    "wer_unseen_engine": 0.10,
    "wer_judged_styles": 0.05,
    "wer_judged_styles_10db": 0.10,
}
TITLES: Final = {
    "known_voices": "eSpeak, voices of training",
    "known_flite": "flite, voices of training",
    "held_out_voices": "eSpeak, voices never heard",
    "unseen_engine": "festival, an engine never heard",
    "held_styles": "Kokoro, six styles never heard",
    "judged_styles": "Kokoro, five styles never heard, by which nothing was chosen",
}
_FEW: Final = 8


def verdict(metrics: dict[str, Any]) -> str:
    """Return a sentence on whether the model does what is asked of it."""
    told = {name: metrics.get(name) for name in AIMS}
    figures = ", ".join(
        f"{name} {'not measured' if value is None else f'{value:.1%}'} (at most {AIMS[name]:.0%})"
        for name, value in told.items()
    )
    if all(value is not None and value <= AIMS[name] for name, value in told.items()):
        return f"It reaches its aims: {figures}."
    return f"**It does not reach its aims: {figures}.** Train it longer."


def card(metrics: dict[str, Any], model: Path, size: TrainingSize) -> str:
    """Return the model card."""
    training = metrics["training"]
    values = {
        "verdict": verdict(metrics),
        "size_kib": sum(path.stat().st_size for path in model.glob("*.bin")) // 1024,
        "encoder_layers": size.encoder_layers,
        "decoder_layers": size.decoder_layers,
        "width": size.width,
        "text_tokens": size.text_tokens,
        "accents": len(ACCENTS),
        "variants": len(VARIANTS) + len(ROBOTIC_VARIANTS),
        "held_out_accent": HELD_OUT_ACCENT,
        "held_out_variants": ", ".join(HELD_OUT_VARIANTS),
        "held_styles": ", ".join(kokoro.DEVELOPMENT),
        "judged_styles": ", ".join(kokoro.JUDGED),
        "clips": training["clips"],
        "packaged": ", ".join(
            f"{engine} ({_listed(tuple(dict.fromkeys(names)))})"
            for engine, names in PACKAGED_VOICES.items()
        ),
        "heard_h": f"{training['heard_s'] / 3600:.0f}",
        "steps": training["steps"],
        "minutes": f"{training['budget_s'] / 60:.0f}",
        "seed": training["seed"],
        "went_on": went_on(training["heard_before_s"], training.get("is_mean", False)),
        "start_from": " --start-from THE-ONE-SHIPPED-BEFORE" * (training["heard_before_s"] > 0.0),
        "name": size.name,
        "sentences": metrics["sentences"],
        "table": table(metrics),
        "voices": voices(metrics),
        "talk": metrics["other_sounds"]["count"],
        "least_confidence": metrics["least_confidence"],
        "beam": metrics["beam"],
        **{
            f"{name}_unsure": _share(metrics["other_sounds"][f"{name}_unsure_ratio"])
            for name in ("talk", "foreign", "noise")
        },
        "accepted_right": _share(metrics["sureness"]["accepted_right_ratio"]),
        "right_accepted": _share(metrics["sureness"]["right_accepted_ratio"]),
    }
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(values)


def went_on(heard_before_s: float, is_mean: bool = False) -> str:
    """Return what the training began with."""
    if not heard_before_s:
        return "It began with weights at random."
    return (
        "It began with the weights of the recogniser that was shipped before it, which had heard "
        f"{heard_before_s / 3600:.0f} h."
        + is_mean
        * " Its weights are the mean of both (step `mean`, with the same --start-from)."
    )


def table(metrics: dict[str, Any]) -> str:
    """Return error rates by who speaks, quiet and in noise."""
    lines = [
        "| who speaks | word errors | exact | word errors at 10 dB | exact at 10 dB |",
        "|---|---|---|---|---|",
    ]
    for name, title in TITLES.items():
        cells = [
            _share(metrics[f"{figure}_{name}{suffix}"])
            for suffix in ("", "_10db")
            for figure in ("wer", "exact")
        ]
        lines.append(f"| {title} | {' | '.join(cells)} |")
    return "\n".join(lines)


def voices(metrics: dict[str, Any]) -> str:
    """Return error rates of the voices that training never heard, one by one."""
    names = ("held_out_voices", "unseen_engine", "held_styles", "judged_styles")
    told = {who: told for name in names for who, told in metrics[f"by_voice_{name}"].items()}
    listed = ", ".join(f"{voice} {_share(ratio)}" for voice, ratio in told.items())
    return f"By voice, quiet: {listed}."


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names) if len(names) <= _FEW else f"{len(names)} voices"


def _share(ratio: float | None) -> str:
    return "not measured" if ratio is None else f"{ratio:.1%}"


def read_metrics(path: Path) -> dict[str, Any]:
    """Return the figures of a model.

    Raises:
        FileNotFoundError: it was not judged.
    """
    metrics: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return metrics
