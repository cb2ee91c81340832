"""Record into one file, in the caller's own process, whatever else records."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S
from vla_deploy.ipc import SharedSpace
from vla_deploy.runtime.node import NodeContext
from vla_deploy.telemetry.errors import RecordingRefused
from vla_deploy.telemetry.recording.messages import RunMessages
from vla_deploy.telemetry.recording.recording_file import RecordingFile
from vla_deploy.telemetry.recording.request import RecordingRequest

PERIOD_NS: Final = NS_PER_S // 25
_FLUSH_NS: Final = NS_PER_S


class OneRecording:
    """Record a run into one file, in the caller's own thread.

    Raises:
        RecordingRefused: the file cannot be written.
    """

    def __init__(
        self,
        context: NodeContext,
        request: RecordingRequest,
        path: Path,
        *,
        image_period_s: float,
        wall_ns: Callable[[], int],
    ) -> None:
        self._path = path
        self._clock = clock = context.clock
        self._duration_s = request.duration_s
        self._space = SharedSpace(context.run_dir / "ipc", clock)
        self._messages = RunMessages(
            self._space,
            context,
            request.selection,
            image_period_s=image_period_s,
            wanted=request.selection.takes,
        )
        now_ns = clock.now_ns()
        self._part = path.with_name(f".{path.name}.part")
        offset_ns = wall_ns() - now_ns
        try:
            self._file = RecordingFile(self._part, context, request.selection, now_ns, offset_ns)
        except OSError as error:
            raise _refused(path, error) from error

    def run(self, should_stop: Callable[[], bool]) -> int:
        """Record until the duration is over or `should_stop()`; return the number of messages.

        Raises:
            RecordingRefused: the file cannot be written; its whole messages can be recovered.
        """
        file, clock = self._file, self._clock
        duration_s = math.inf if self._duration_s is None else self._duration_s
        ends_ns = clock.now_ns() + duration_s * NS_PER_S
        flush_ns = clock.now_ns() + _FLUSH_NS
        try:
            file.add(self._messages.constant_views(clock.now_ns(), file.offset_ns))
            while clock.now_ns() < ends_ns and not should_stop():
                now_ns = clock.now_ns()
                file.add(self._messages.new(now_ns, file.offset_ns))
                if now_ns >= flush_ns:
                    flush_ns = now_ns + _FLUSH_NS
                    file.flush()
                clock.sleep_until(now_ns + PERIOD_NS)
            file.finish()
            self._part.rename(self._path)
        except OSError as error:
            file.abandon()
            raise _refused(self._path, error) from error
        finally:
            self._space.close()
        return file.messages


def _refused(path: Path, error: OSError) -> RecordingRefused:
    return RecordingRefused(f"{path}: {error.strerror or error}; name another file with -o")
