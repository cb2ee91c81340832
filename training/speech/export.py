"""Write the trained weights as a Whisper in CTranslate2's form, eight bits a weight."""

import json
import tempfile
from pathlib import Path
from typing import Any, Final

import torch
from ctranslate2.converters import TransformersConverter
from transformers import WhisperConfig, WhisperForConditionalGeneration

from training.speech.clips.features import HOP, N_FFT
from training.speech.network import LARGEST_FRAMES, MELS, TEXT_POSITIONS
from training.speech.sizes import TrainingSize
from training.speech.tokens import TOKENIZER, Coder, settings

PREPROCESSOR: Final = "preprocessor_config.json"
_HEAD: Final = "sounds."
_FIXED: Final = "encoder.embed_positions.weight"


def export(weights: Path, tokenizer: Path, size: TrainingSize, target: Path) -> None:
    """Convert weights into the folder `target`; what was there is replaced.

    Raises:
        FileNotFoundError: weights or tokenizer are not there.
    """
    values = torch.load(weights, weights_only=True)
    values = values.get("average", values)
    with tempfile.TemporaryDirectory() as folder:
        model = _model(Coder.load(tokenizer), size)
        kept = {f"model.{name}": v for name, v in values.items() if not name.startswith(_HEAD)}
        missing, unknown = model.load_state_dict(kept, strict=False)
        # The output layer is the embedding itself.
        if unknown or set(missing) - {"proj_out.weight"}:
            raise ValueError(f"{weights}: missing {missing}, unknown {unknown}")
        model.save_pretrained(folder)
        (Path(folder) / TOKENIZER).write_bytes(tokenizer.read_bytes())
        (Path(folder) / "tokenizer_config.json").write_text(settings(), encoding="utf-8")
        (Path(folder) / PREPROCESSOR).write_text(_preprocessor(), encoding="utf-8")
        converter = TransformersConverter(folder, copy_files=[TOKENIZER, PREPROCESSOR])
        converter.convert(str(target), quantization="int8", force=True)


def _preprocessor() -> str:
    kind: dict[str, Any] = {
        "feature_extractor_type": "WhisperFeatureExtractor",
        "feature_size": MELS,
        "sampling_rate": 16_000,
        "hop_length": HOP,
        "n_fft": N_FFT,
        # The encoder takes 3000 frames; with this hop they last a minute.
        "chunk_length": LARGEST_FRAMES * HOP // 16_000,
    }
    return json.dumps(kind, indent=1)


def _model(coder: Coder, size: TrainingSize) -> WhisperForConditionalGeneration:
    config = WhisperConfig(
        vocab_size=coder.count,
        num_mel_bins=MELS,
        d_model=size.width,
        encoder_layers=size.encoder_layers,
        decoder_layers=size.decoder_layers,
        encoder_attention_heads=size.heads,
        decoder_attention_heads=size.heads,
        encoder_ffn_dim=4 * size.width,
        decoder_ffn_dim=4 * size.width,
        max_source_positions=LARGEST_FRAMES // 2,
        max_target_positions=TEXT_POSITIONS,
        bos_token_id=coder.end,
        eos_token_id=coder.end,
        pad_token_id=coder.end,
        decoder_start_token_id=coder.start,
        suppress_tokens=None,
        begin_suppress_tokens=None,
    )
    model = WhisperForConditionalGeneration(config)
    heads = [[size.decoder_layers - 1, head] for head in range(size.heads)]
    model.generation_config.alignment_heads = heads
    model.generation_config.lang_to_id = {}
    model.generation_config.suppress_tokens = []
    # Nothing is barred from the beginning: of a noise the model writes nothing.
    model.generation_config.begin_suppress_tokens = []
    model.generation_config.pad_token_id = coder.end
    return model
