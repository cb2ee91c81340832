"""Choose channels by patterns."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from fnmatch import fnmatchcase

from vla_deploy.telemetry.errors import RecordingRefused

EVERYTHING = ("*",)


@dataclass(frozen=True, slots=True, kw_only=True)
class Selection:
    """Take what one of `topics` matches and none of `without`: names with `*`, `?` and `[...]`.

    The name of a topic stands for all its channels: `rgbd` for `rgbd/colour` and `rgbd/depth`.
    """

    topics: tuple[str, ...] = EVERYTHING
    without: tuple[str, ...] = ()
    _known: dict[str, bool] = field(default_factory=dict, repr=False, compare=False)

    def takes(self, channel: str) -> bool:
        """Tell whether a channel is chosen."""
        known = self._known.get(channel)
        if known is None:
            known = _any(channel, self.topics) and not _any(channel, self.without)
            self._known[channel] = known
        return known

    def takes_any_of(self, topic: str) -> bool:
        """Tell whether one of a topic's channels may be chosen: only its parts are known apart."""
        return self.takes(topic) or any(
            self.takes(f"{topic}/{part}") for part in ("colour", "depth")
        )

    def among(self, channels: Iterable[str]) -> tuple[str, ...]:
        """Return the chosen ones.

        Raises:
            RecordingRefused: a pattern matches none of them, or nothing is left.
        """
        names = tuple(channels)
        for pattern in (*self.topics, *self.without):
            if not any(_any(name, (pattern,)) for name in names):
                raise RecordingRefused(
                    f"no topic matches {pattern!r}; there are, for instance, "
                    f"{', '.join(names[:3])}; see: vla-deploy record topics"
                )
        chosen = tuple(name for name in names if self.takes(name))
        if not chosen:
            raise RecordingRefused(
                f"topics {', '.join(self.topics)} without {', '.join(self.without)} leaves nothing"
            )
        return chosen


def _any(channel: str, patterns: Iterable[str]) -> bool:
    topic = channel.partition("/")[0]
    return any(fnmatchcase(channel, pattern) or fnmatchcase(topic, pattern) for pattern in patterns)
