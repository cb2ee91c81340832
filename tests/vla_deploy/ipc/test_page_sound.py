"""A record of the page's sound comes back as it was packed, and nothing else is taken for one."""

import numpy as np
import pytest

from vla_deploy.ipc import BadPayload
from vla_deploy.ipc.page_sound import PageSound, SoundStep, unpacked


def test_a_record_comes_back() -> None:
    said = np.array([0, -32768, 32767], np.int16)
    sound = unpacked(PageSound(turn=7, rate_hz=48_000, step=SoundStep.SOUND, samples=said).packed())
    assert (sound.turn, sound.rate_hz, sound.step) == (7, 48_000, SoundStep.SOUND)
    assert sound.samples.tolist() == said.tolist()
    assert not unpacked(PageSound(turn=7, rate_hz=16_000, step=SoundStep.CUT).packed()).samples.size


@pytest.mark.parametrize("payload", [b"", b"\x01" * 12, b"\x01" * 13, bytes(11)])
def test_anything_else_is_refused(payload: bytes) -> None:
    with pytest.raises(BadPayload, match="page_sound"):
        unpacked(payload)
