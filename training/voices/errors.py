"""Tell why there is no voice.

VoicesError
  EngineMissing     the engine's library, program or voice is not installed
  SynthesisFailed   the engine gave no sound
"""


class VoicesError(Exception):
    """Be the root of what goes wrong with synthetic voices."""


class EngineMissing(VoicesError):
    """Say which part of an engine is missing, and what to install."""

    def __init__(self, engine: str, part: str, packages: str, by: str = "apt-get install") -> None:
        super().__init__(f"{engine}: {part} is not installed; try: {by} {packages}")
        self.engine = engine


class SynthesisFailed(VoicesError):
    """Say what an engine would not speak."""

    def __init__(self, engine: str, voice: str, text: str, why: str) -> None:
        super().__init__(f"{engine}, voice {voice}: {why}; text: {text[:80]!r}")
