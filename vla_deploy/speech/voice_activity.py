"""Judge frame by frame whether a voice is heard: Silero's network, from faster-whisper's package.

It takes 576 samples, the 64 before a frame of 512 and the frame, and carries its memory from frame
to frame: fed so, it says what it says of a whole recording.
"""

from importlib.util import find_spec
from pathlib import Path
from typing import Final

import numpy as np

from vla_deploy.inference.opening import GraphSession, open_graph
from vla_deploy.speech.errors import SpeechMissing
from vla_deploy.speech.sound import Sound

_CONTEXT: Final = 64
_MEMORY: Final = (1, 1, 128)
_PACKAGE: Final = "faster_whisper"
_FILE: Final = Path("assets") / "silero_vad_v6.onnx"
_OUTPUTS: Final = ("speech_probs", "hn", "cn")


class VoiceActivity:
    """Follow one stream of frames."""

    def __init__(self, graph: GraphSession) -> None:
        self._graph = graph
        self.reset()

    def reset(self) -> None:
        """Forget what came before: the next frame does not continue it."""
        self._context = np.zeros(_CONTEXT, np.float32)
        self._h = np.zeros(_MEMORY, np.float32)
        self._c = np.zeros(_MEMORY, np.float32)

    def probability(self, frame: Sound) -> float:
        """Return how probable it is that a frame of 512 samples holds a voice.

        Raises:
            RunFailed: the network fails, or another version of the package brings another one.
        """
        sound = np.concatenate((self._context, frame))[None]
        answer = self._graph.run(_OUTPUTS, {"input": sound, "h": self._h, "c": self._c})
        self._context = frame[-_CONTEXT:]
        self._h, self._c = answer["hn"], answer["cn"]
        return float(answer["speech_probs"][0])

    def close(self) -> None:
        """Release the network."""
        self._graph.close()


def open_voice_activity() -> VoiceActivity:
    """Open the network on one thread of the CPU.

    Raises:
        SpeechMissing: faster-whisper, which brings it, is not installed.
        ModelFileSpoiled: its file is missing or no graph.
    """
    found = find_spec(_PACKAGE)
    if found is None or found.origin is None:
        raise SpeechMissing(
            "hearing needs faster-whisper: pip install 'vla-deploy[speech]'; typed commands go on"
        )
    return VoiceActivity(open_graph(Path(found.origin).parent / _FILE))
