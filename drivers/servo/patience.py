"""Say how long an answer of a servo is waited for."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplyPatience:
    """Say how long beyond the wire time to wait for an answer, and how often to ask."""

    margin_s: float
    attempts: int
