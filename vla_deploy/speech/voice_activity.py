"""Judge frame by frame whether a voice is heard: Silero's network, from faster-whisper's package.

It takes 576 samples, the 64 before a frame of 512 and the frame, and carries its memory from frame
to frame: fed so, it says what it says of a whole recording.
"""

from importlib.util import find_spec
from pathlib import Path
from typing import Final

import numpy as np

from drivers.clock import Clock
from vla_deploy.inference.file_check import sha256_of
from vla_deploy.inference.manifest import Manifest, ModelFile, Tensor, Variant
from vla_deploy.inference.opening import PLAIN_CHOICE
from vla_deploy.inference.session import ModelSession, open_session
from vla_deploy.inference.store import Model
from vla_deploy.speech.errors import SpeechMissing
from vla_deploy.speech.sound import FRAME, Sound

ROLE: Final = "voice_activity"
_CONTEXT: Final = 64
_MEMORY: Final = (1, 1, 128)
_FILE: Final = "silero_vad_v6.onnx"
_PACKAGE: Final = "faster_whisper"


class VoiceActivity:
    """Follow one stream of frames."""

    def __init__(self, session: ModelSession) -> None:
        self._session = session
        self.reset()

    def reset(self) -> None:
        """Forget what came before: the next frame does not continue it."""
        self._context = np.zeros(_CONTEXT, np.float32)
        self._h = np.zeros(_MEMORY, np.float32)
        self._c = np.zeros(_MEMORY, np.float32)

    def probability(self, frame: Sound) -> float:
        """Return how probable it is that a frame of 512 samples holds a voice.

        Raises:
            RunFailed: the network fails.
        """
        sound = np.concatenate((self._context, frame))[None]
        answer = self._session.run({"input": sound, "h": self._h, "c": self._c})
        self._context = frame[-_CONTEXT:]
        self._h, self._c = answer["hn"], answer["cn"]
        return float(answer["speech_probs"][0])

    def close(self) -> None:
        """Release the network."""
        self._session.close()


def open_voice_activity(clock: Clock) -> VoiceActivity:
    """Open the network on one thread of the CPU.

    Raises:
        SpeechMissing: faster-whisper, which brings it, is not installed.
        ModelFileSpoiled: its file is missing or no graph.
        ModelMismatch: another version of the package brings another network.
    """
    model = _model()
    session = open_session(model, PLAIN_CHOICE, engines=model.folder, clock=clock)
    return VoiceActivity(session)


def _model() -> Model:
    """Return the network that the package brings; its graph is checked when it is opened."""
    found = find_spec(_PACKAGE)
    if found is None or not found.submodule_search_locations:
        raise SpeechMissing(
            "hearing needs faster-whisper: pip install 'vla-deploy[speech]'; typed commands go on"
        )
    folder = Path(found.submodule_search_locations[0]) / "assets"
    memory = tuple(_MEMORY)
    manifest = Manifest(
        name="silero",
        role=ROLE,
        summary="voice activity, Silero VAD 6",
        licence="MIT",
        card="",
        inputs=(
            Tensor(name="input", shape=("frames", _CONTEXT + FRAME), dtype="float32"),
            Tensor(name="h", shape=memory, dtype="float32"),
            Tensor(name="c", shape=memory, dtype="float32"),
        ),
        outputs=(
            Tensor(name="speech_probs", shape=("frames",), dtype="float32"),
            Tensor(name="hn", shape=memory, dtype="float32"),
            Tensor(name="cn", shape=memory, dtype="float32"),
        ),
        files={Variant.FP32: ModelFile(path=_FILE, sha256=sha256_of(folder / _FILE))},
    )
    return Model(manifest=manifest, folder=folder, is_embedded=True)
