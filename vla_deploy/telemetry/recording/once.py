"""Record into one file of one's own, beside the robot and whatever else records."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Final

from drivers.clock import NS_PER_S, Clock
from vla_deploy.ipc import SharedSpace
from vla_deploy.runtime.logs import LOGS_DIR
from vla_deploy.telemetry.errors import RecordingRefused
from vla_deploy.telemetry.following import Following
from vla_deploy.telemetry.recording.batch import Drafter
from vla_deploy.telemetry.recording.collecting import Collector
from vla_deploy.telemetry.recording.recording_file import RecordedRun, RecordingFile
from vla_deploy.telemetry.recording.request import RecordingWish

PERIOD_NS: Final = NS_PER_S // 25
_FLUSH_NS: Final = NS_PER_S


class OneRecording:
    """Record a run into one file, in the caller's own thread.

    Raises:
        RecordingRefused: the file cannot be written.
    """

    def __init__(
        self,
        run_dir: Path,
        run: RecordedRun,
        wish: RecordingWish,
        path: Path,
        *,
        image_period_s: float,
        clock: Clock,
        wall_ns: Callable[[], int],
    ) -> None:
        self._path = path
        self._clock = clock
        self._wish = wish
        self._space = SharedSpace(run_dir / "ipc", clock)
        self._following = Following(self._space, from_start=False)
        logs = run_dir / LOGS_DIR
        self._collector = Collector(self._space, logs, wish.selection, image_period_s)
        self._drafter = Drafter(run.robot, wish.selection.takes)
        now_ns = clock.now_ns()
        self._part = path.with_name(f".{path.name}.part")
        offset_ns = wall_ns() - now_ns
        try:
            self._file = RecordingFile(self._part, run, wish.selection, now_ns, offset_ns)
        except OSError as error:
            raise _refused(path, error) from error

    def run(self, should_stop: Callable[[], bool]) -> int:
        """Record until the wish's duration is over or `should_stop()`; return the messages.

        Raises:
            RecordingRefused: the file cannot be written; what there is of it can be recovered.
        """
        file, clock = self._file, self._clock
        duration_s = self._wish.duration_s
        ends_ns = math.inf if duration_s is None else clock.now_ns() + duration_s * NS_PER_S
        flush_ns = clock.now_ns() + _FLUSH_NS
        try:
            file.add(self._drafter.still(clock.now_ns(), file.offset_ns))
            while clock.now_ns() < ends_ns and not should_stop():
                now_ns = clock.now_ns()
                batch = self._collector.batch(now_ns, self._following.fresh())
                file.add(self._drafter.messages(batch, file.offset_ns))
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
