"""Say where in a file a replay stands: pure, on the clock that is handed in."""

from typing import Final

from vla_deploy.telemetry.errors import ReplayRefused

SLOWEST: Final = 0.05
FASTEST: Final = 50.0


class Pace:
    """Move from `began_ns` to `ended_ns` of a file, at a speed that may change on the way."""

    def __init__(self, began_ns: int, ended_ns: int, now_ns: int) -> None:
        self.began_ns = began_ns
        self.ended_ns = ended_ns
        self.speed = 1.0
        self.is_paused = False
        self._from_ns = began_ns
        self._since_ns = now_ns

    def position_ns(self, now_ns: int) -> int:
        """Return the moment of the file that is shown now."""
        if self.is_paused:
            return self._from_ns
        gone_ns = round((now_ns - self._since_ns) * self.speed)
        return min(self._from_ns + gone_ns, self.ended_ns)

    def has_ended(self, now_ns: int) -> bool:
        """Tell whether all of the file has been shown."""
        return self.position_ns(now_ns) >= self.ended_ns

    def pause(self, now_ns: int, *, paused: bool) -> None:
        """Stand still, or go on."""
        self._anchor(now_ns)
        self.is_paused = paused

    def go_at(self, now_ns: int, speed: float) -> None:
        """Go at another speed from here on; 1 is the speed of the recording.

        Raises:
            ReplayRefused: that is too slow or too fast.
        """
        if not SLOWEST <= speed <= FASTEST:
            raise ReplayRefused(f"speed: expected {SLOWEST} to {FASTEST}, got {speed}")
        self._anchor(now_ns)
        self.speed = speed

    def seek(self, now_ns: int, at_s: float) -> int:
        """Go on from so many seconds after the beginning, and return that moment.

        Raises:
            ReplayRefused: that is beyond the file.
        """
        length_s = (self.ended_ns - self.began_ns) / 1e9
        if not 0.0 <= at_s <= length_s:
            raise ReplayRefused(f"seek: expected 0 to {length_s:.1f} s, got {at_s}")
        self._from_ns, self._since_ns = self.began_ns + round(at_s * 1e9), now_ns
        return self._from_ns

    def _anchor(self, now_ns: int) -> None:
        self._from_ns, self._since_ns = self.position_ns(now_ns), now_ns
