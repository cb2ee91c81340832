"""Turn speech into text by a Whisper in CTranslate2's form, and tell what speaks for it."""

import os
from dataclasses import replace
from typing import Any, Final

import numpy as np

from drivers.clock import NS_PER_S, Clock, MonotonicClock
from platforms import ModelChoice
from vla_deploy.inference.errors import ModelFileSpoiled, ProviderUnavailable, RunFailed
from vla_deploy.inference.manifest import EncoderContext, Whisper
from vla_deploy.inference.memory_claims import MemoryClaim, resident_mb
from vla_deploy.inference.providers import CPU, CUDA
from vla_deploy.inference.store import StoredModel
from vla_deploy.runtime.executors import low_priority_thread
from vla_deploy.runtime.one_line import one_line
from vla_deploy.speech.errors import import_extra
from vla_deploy.speech.sound import RATE_HZ, Sound
from vla_deploy.speech.transcript import Transcript, confidence

_COMPUTE: Final = {
    (CPU, "int8"): "int8",
    (CPU, "fp16"): "float32",
    (CPU, "fp32"): "float32",
    (CUDA, "int8"): "int8_float16",
    (CUDA, "fp16"): "float16",
    (CUDA, "fp32"): "float32",
}
_DEVICES: Final = {CPU: "cpu", CUDA: "cuda"}
_RUNTIME: Final = "vla_deploy.speech.whisper_runtime"
_MODEL_ERRORS: Final = (RuntimeError, ValueError, OSError, KeyError, TypeError)
"""What faster-whisper and CTranslate2 raise."""


class Recogniser:
    """Read phrases one at a time, in this thread or another one."""

    def __init__(
        self,
        model: StoredModel,
        declared: Whisper,
        whisper: Any,
        clock: Clock,
        *,
        provider: str,
        beam: int,
    ) -> None:
        """Take an open Whisper over; `open_recogniser` makes one."""
        self.model = model
        self.declared = declared
        self.provider = provider
        self.load_s = 0.0
        self.memory_mb = 0.0
        self.claim = MemoryClaim()
        self._whisper: Any = whisper
        self._clock = clock
        self._beam = beam

    def read(self, samples: Sound) -> Transcript:
        """Return what is said in a phrase of at most 29 s.

        Raises:
            RunFailed: the model fails, or is closed.
        """
        if self._whisper is None:
            raise RunFailed(f"{self.model.manifest.name}: it is closed")
        started_ns = self._clock.now_ns()
        try:
            transcript: Transcript = self._whisper.read(
                samples, languages=self.declared.languages, beam=self._beam
            )
        except _MODEL_ERRORS as error:
            raise RunFailed(f"{self.model.manifest.name}: {one_line(error)}") from error
        return replace(
            transcript,
            confidence=confidence(transcript, self.declared.calibration),
            took_s=(self._clock.now_ns() - started_ns) / NS_PER_S,
        )

    def close(self) -> None:
        """Release the memory; closing twice is allowed."""
        if self._whisper is not None:
            self._whisper.model.unload_model()
        self._whisper = None
        self.claim.release()


def open_recogniser(
    model: StoredModel, choice: ModelChoice, *, beam: int, clock: Clock
) -> Recogniser:
    """Open a model as a profile's choice asks, and warm it up.

    Raises:
        SpeechMissing: faster-whisper is not installed.
        ModelFileSpoiled: a file is not what was checked in, or is none of a Whisper.
        ProviderUnavailable: nothing here runs it as the choice asks.
        RunFailed: it cannot run.
    """
    before_mb, started_ns = resident_mb(), clock.now_ns()
    runtime = import_extra(_RUNTIME, "turning speech into text needs faster-whisper")
    # Hashing half a gigabyte gives way to the steps. The model itself is made by this thread, since
    # the threads that it starts inherit the priority, and phrases are to be read without delay.
    with low_priority_thread(MonotonicClock()) as thread:
        thread.submit(model.check_parts).result()
    provider, declared = _provider(choice, runtime), model.manifest.whisper
    assert declared is not None, "only manifests of a Whisper come here"
    try:
        whisper = runtime.WhisperRuntime(
            model.folder,
            trimmed=declared.context == EncoderContext.TRIMMED,
            device=_DEVICES[provider],
            compute_type=_COMPUTE[provider, choice.precision],
            cpu_threads=min(choice.threads, len(os.sched_getaffinity(0))),
            num_workers=1,
        )
    except _MODEL_ERRORS as error:
        raise ModelFileSpoiled(
            f"{model.folder}: {runtime.VERSION} cannot load it: {one_line(error)}; expected a "
            "Whisper converted by CTranslate2: add the model again"
        ) from error
    recogniser = Recogniser(model, declared, whisper, clock, provider=provider, beam=beam)
    recogniser.read(np.zeros(RATE_HZ, np.float32))
    recogniser.load_s = (clock.now_ns() - started_ns) / NS_PER_S
    recogniser.memory_mb = max(0.0, resident_mb() - before_mb)
    return recogniser


def _provider(choice: ModelChoice, runtime: Any) -> str:
    """Return the first provider of a choice that CTranslate2 has here.

    Raises:
        ProviderUnavailable: there is none.
    """
    asked = (*choice.providers, CPU) if choice.cpu_fallback else choice.providers
    for provider in asked:
        there = provider == CPU or (provider == CUDA and runtime.cuda_devices() > 0)
        if there and (provider, choice.precision) in _COMPUTE:
            return provider
    raise ProviderUnavailable(
        f"CTranslate2 here runs nothing of {', '.join(asked)} in {choice.precision}; "
        "allow the CPU in int8 or fp32, or install a CTranslate2 built with CUDA"
    )
