"""Map a device's own time stamps to the host's monotonic time.

A stamp reaches the host late by a latency that varies but is never negative, so the smallest
difference "arrival minus stamp" seen lately is the best estimate of the offset between the clocks.
Two alternating windows let the estimate follow slow drift.
"""

from drivers.clock import NS_PER_S

WINDOW_NS = 10 * NS_PER_S
RESTART_NS = NS_PER_S


class DeviceClock:
    """Estimate the offset of one device clock by minimum latency.

    `wrap_ns` is the value at which the device's counter starts again, 0 where it does not wrap.
    """

    def __init__(self, wrap_ns: int = 0) -> None:
        self._wrap_ns = wrap_ns
        self._epoch_ns = 0
        self._last_raw_ns: int | None = None
        self._window_start_ns = 0
        self._offset_ns: int | None = None
        self._previous_offset_ns: int | None = None

    def to_host_ns(self, raw_ns: int, arrival_ns: int) -> int:
        """Return when, on the host's clock, the device took the stamp `raw_ns`."""
        device_ns = self._unwrap(raw_ns)
        self._observe(arrival_ns - device_ns, arrival_ns)
        candidates = [o for o in (self._offset_ns, self._previous_offset_ns) if o is not None]
        return device_ns + min(candidates)

    def _unwrap(self, raw_ns: int) -> int:
        last_ns = self._last_raw_ns
        self._last_raw_ns = raw_ns
        if last_ns is not None and raw_ns < last_ns:
            if self._wrap_ns and last_ns - raw_ns > self._wrap_ns // 2:
                self._epoch_ns += self._wrap_ns
            elif last_ns - raw_ns > RESTART_NS:
                self._forget()
        return self._epoch_ns + raw_ns

    def _observe(self, offset_ns: int, arrival_ns: int) -> None:
        if self._offset_ns is not None and abs(offset_ns - self._offset_ns) > RESTART_NS:
            self._forget()
        if self._offset_ns is None:
            self._offset_ns, self._window_start_ns = offset_ns, arrival_ns
        elif arrival_ns - self._window_start_ns > WINDOW_NS:
            self._previous_offset_ns = self._offset_ns
            self._offset_ns, self._window_start_ns = offset_ns, arrival_ns
        else:
            self._offset_ns = min(self._offset_ns, offset_ns)

    def _forget(self) -> None:
        """Start anew after the device restarted or was out of touch."""
        self._offset_ns = None
        self._previous_offset_ns = None
