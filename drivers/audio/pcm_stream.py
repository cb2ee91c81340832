"""Drive a microphone or speaker that is a stream: that of a sound server, or of the twin's room."""

from typing import Final

import numpy as np

from drivers.audio.base import AudioBlock, AudioCounters, AudioFormat, Samples, check_samples
from drivers.audio.pcm_protocol import PcmBlock, PcmParser, encode_block
from drivers.base import ByteTransport
from drivers.clock import NS_PER_S, Clock
from drivers.device_clock import DeviceClock
from drivers.errors import WrongDevice

AHEAD_NS: Final = NS_PER_S // 4
_READ_BYTES: Final = 1 << 16
_MAX_READS: Final = 64


class PcmInput:
    """Read samples as they arrive."""

    def __init__(self, stream: ByteTransport, clock: Clock, format_: AudioFormat) -> None:
        self.format = format_
        self.counters = AudioCounters()
        self._stream = stream
        self._clock = clock
        self._parser = PcmParser()
        self._device_clock = DeviceClock()
        self._next_row: int | None = None
        self._last_stamp_ns = 0

    def poll(self) -> AudioBlock | None:
        """Return the samples since the last call as one block, or None; never waits.

        Rows that were lost under way are silence in the block, so that its times stay true; what
        was told before is not told again.

        Raises:
            LinkLost: the stream has gone.
            WrongDevice: the stream has another rate or other channels than declared.
        """
        arrived = self._blocks()
        for block in arrived:
            self._check(block)
        blocks = self._new(arrived)
        if not blocks:
            return None
        now_ns = self._clock.now_ns()
        stamps = [self._device_clock.to_host_ns(block.stamp_ns, now_ns) for block in blocks]
        self._last_stamp_ns = max(stamps[0], self._last_stamp_ns + 1)
        return AudioBlock(
            stamp_ns=self._last_stamp_ns, format=self.format, samples=self._joined(blocks)
        )

    def close(self) -> None:
        """Release the stream; closing twice is allowed."""
        self._stream.close()

    def _blocks(self) -> list[PcmBlock]:
        blocks: list[PcmBlock] = []
        for _ in range(_MAX_READS):
            chunk = self._stream.read(_READ_BYTES, 0)
            if not chunk:
                break
            blocks += self._parser.feed(chunk)
        self.counters.crc_errors = self._parser.crc_errors
        self.counters.discarded_bytes = self._parser.discarded_bytes
        return blocks

    def _new(self, blocks: list[PcmBlock]) -> list[PcmBlock]:
        """Drop repeated blocks; rows from long ago are those of a stream that began anew."""
        new: list[PcmBlock] = []
        next_row = self._next_row
        for block in blocks:
            if next_row is not None and 0 < next_row - block.first_row <= self.format.rate_hz:
                self.counters.repeated_blocks += 1
                continue
            new.append(block)
            next_row = block.first_row + len(block.samples)
        return new

    def _joined(self, blocks: list[PcmBlock]) -> Samples:
        parts: list[Samples] = []
        first = True
        for block in blocks:
            lost = 0 if self._next_row is None else max(0, block.first_row - self._next_row)
            self.counters.lost_samples += lost
            if lost and not first:
                gap = min(lost, self.format.rate_hz)
                parts.append(np.zeros((gap, self.format.channels), np.int16))
            first = False
            parts.append(block.samples)
            self.counters.blocks += 1
            self.counters.samples += len(block.samples)
            self._next_row = block.first_row + len(block.samples)
        return np.concatenate(parts)

    def _check(self, block: PcmBlock) -> None:
        if block.format != self.format:
            raise WrongDevice(
                f"audio: {self.format} declared, {block.format} got; correct the robot file"
            )


class PcmOutput:
    """Send samples, at most a quarter of a second ahead of what has been played."""

    def __init__(self, stream: ByteTransport, clock: Clock, format_: AudioFormat) -> None:
        self.format = format_
        self.counters = AudioCounters()
        self._stream = stream
        self._clock = clock
        self._row = 0
        self._played_until_ns = 0

    def write(self, samples: Samples) -> int:
        """Hand over what there is room for and return how many rows that was; never waits.

        Raises:
            ValueError: the samples do not have the format's channels.
            LinkLost: the stream has gone.
        """
        check_samples(samples, self.format)
        now_ns = self._clock.now_ns()
        starts_ns = max(self._played_until_ns, now_ns)
        room = (now_ns + AHEAD_NS - starts_ns) * self.format.rate_hz // NS_PER_S
        taken = samples[: max(0, room)]
        if len(taken):
            self._send(taken, starts_ns)
        return len(taken)

    def close(self) -> None:
        """Release the stream; closing twice is allowed."""
        self._stream.close()

    def _send(self, samples: Samples, starts_ns: int) -> None:
        block = PcmBlock(
            format=self.format, first_row=self._row, stamp_ns=starts_ns, samples=samples
        )
        self._stream.write(encode_block(block))
        self._row += len(samples)
        self._played_until_ns = starts_ns + self.format.duration_ns(len(samples))
        self.counters.blocks += 1
        self.counters.samples += len(samples)
