"""Hold who is believed, and how much anybody may ask."""

from dataclasses import dataclass
from typing import Final

_HOUR_S: Final = 3600.0


@dataclass(frozen=True, slots=True, kw_only=True)
class AccessRules:
    """Hold the rules of one dashboard.

    `trust_loopback` makes whoever asks from this computer an admin; behind a reverse proxy on this
    computer that is everybody whom the proxy lets through. `hosts` are further names of the robot,
    `origins` those of pages that a proxy serves for it, such as `https://robot.example`. A session
    ends `session_idle_s` after its last use. Who is known may change `acts_burst` things at once
    and `acts_hz` in the long run.
    """

    trust_loopback: bool = True
    hosts: tuple[str, ...] = ()
    origins: tuple[str, ...] = ()
    is_https: bool = False
    session_idle_s: float = 12 * _HOUR_S
    session_longest_s: float = 168 * _HOUR_S
    acts_hz: float = 10.0
    acts_burst: int = 40
