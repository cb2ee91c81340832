"""Choose the voice that a robot file asks for."""

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from types import MappingProxyType
from typing import Final

from drivers.clock import Clock
from vla_deploy.robots.description import VoiceSettings
from vla_deploy.speech.voice import espeak, piper
from vla_deploy.speech.voice.engine import Engine
from vla_deploy.speech.voice.espeak import EspeakEngine
from vla_deploy.speech.voice.mouth import OpenOutput
from vla_deploy.speech.voice.piper import PiperEngine
from vla_deploy.speech.voice.robot_voice import RobotVoice


def _espeak(settings: VoiceSettings) -> Engine:
    return EspeakEngine(
        voice=settings.voice,
        words_per_minute=settings.words_per_minute,
        pitch=settings.pitch,
        program=settings.program or espeak.PROGRAM,
    )


def _piper(settings: VoiceSettings) -> Engine:
    return PiperEngine(
        voice=settings.voice,
        words_per_minute=settings.words_per_minute,
        program=settings.program or piper.PROGRAM,
    )


ENGINES: Final[Mapping[str, Callable[[VoiceSettings], Engine]]] = MappingProxyType(
    {"espeak-ng": _espeak, "piper": _piper}
)


def chosen_engine(settings: VoiceSettings) -> Engine:
    """Return the engine; whether it is installed shows when it first speaks."""
    return ENGINES[settings.engine](settings)


def build_voice(
    settings: VoiceSettings, open_output: OpenOutput | None, clock: Clock, aside: Executor
) -> RobotVoice | None:
    """Return the voice of a robot; None where it has no speaker."""
    if open_output is None:
        return None
    engine = chosen_engine(settings)
    return RobotVoice(engine, open_output, clock, aside, volume_ratio=settings.volume_ratio)
