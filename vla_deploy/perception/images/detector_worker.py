"""Run the detector outside the steps, and go on without it when it fails.

A robot whose detector cannot be opened, fails, or takes too long names things by their form alone,
and publishes why; its obstacles and its own pose never depend on the detector. A change of profile
that would take away a detector at work is refused instead.
"""

import logging
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import Final

from drivers.clock import NS_PER_S, Clock
from platforms import Profile
from vla_deploy.inference.errors import InferenceError, RunFailed
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.ipc.payloads.scene import SightDocument
from vla_deploy.perception.detectors.detector import ROLE, Detector, open_detector
from vla_deploy.perception.detectors.image_input import Image
from vla_deploy.perception.images.network_view import NetworkView
from vla_deploy.runtime.one_line import one_line

LATE_NS: Final = NS_PER_S
"""The things of an image are named by form alone when the detector has not answered by then."""
FAILURES_TO_DISMISS: Final = 3
"""Failed runs in a row after which a detector is dismissed."""
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadedDetector:
    """Hold an open detector, or why there is none."""

    detector: Detector | None
    why: str = ""

    def close(self) -> None:
        """Release the memory; a run that is under way ends by itself."""
        if self.detector is not None:
            self.detector.close()


@dataclass(frozen=True, slots=True)
class DetectorAnswer:
    """Hold what the detector found; None where there is none, it failed, or it took too long."""

    view: NetworkView | None


def load_detector(
    shelf: ModelShelf, profile: Profile, model_tier: int, *, replaces_one: bool = False
) -> LoadedDetector:
    """Open the detector that a profile chooses, or return why there is none.

    Raises:
        InferenceError: it cannot be opened, and the profile requires it or another one is at work.
    """
    choice = profile.models.get(ROLE)
    if choice is None:
        return LoadedDetector(detector=None, why=f"profile {profile.name} names no detector")
    try:
        return LoadedDetector(detector=open_detector(shelf, profile, model_tier))
    except InferenceError as error:
        if choice.required or replaces_one:
            raise
        _log.error("degraded: things are named by their form alone: %s", error)
        return LoadedDetector(detector=None, why=one_line(error))


class DetectorWorker:
    """Hold the detector at work, and ask it about one image at a time."""

    def __init__(self, executor: Executor, clock: Clock) -> None:
        """Own an executor: one thread, or one that runs each task at once."""
        self._executor = executor
        self._clock = clock
        self._loaded = LoadedDetector(detector=None, why="not opened yet")
        self._asked: Future[NetworkView] | None = None
        self._asked_ns = 0
        self._given_up = False
        self._closed = False
        self._failures = 0
        self._late = 0
        self._trouble = ""

    @property
    def loaded(self) -> LoadedDetector:
        """Return what is at work."""
        return self._loaded

    def replace(self, loaded: LoadedDetector) -> LoadedDetector:
        """Use another detector from the next image on; return the one before."""
        before, self._loaded = self._loaded, loaded
        self._failures, self._trouble = 0, ""
        return before

    def release(self, loaded: LoadedDetector) -> None:
        """Close a detector that is no longer at work, after its last run."""
        if self._closed:
            loaded.close()
        else:
            self._executor.submit(loaded.close)

    def close(self) -> None:
        """Release everything; a run under way is abandoned."""
        self._closed = True
        self._executor.shutdown(wait=False, cancel_futures=True)
        self._loaded.close()

    def ask(self, rgb: Image) -> None:
        """Start the detector on an image, unless it is still busy with the last one."""
        if self._given_up and self._asked is not None and self._asked.done():
            self._asked, self._given_up = None, False
        detector = self._loaded.detector
        if detector is not None and self._asked is None:
            self._asked_ns = self._clock.now_ns()
            self._asked = self._executor.submit(_detect, detector, rgb)

    def answer(self) -> DetectorAnswer | None:
        """Return what the detector found in the last image, None while it is still at work."""
        if self._asked is None or self._given_up:
            return DetectorAnswer(view=None)
        if not self._asked.done():
            return self._late_answer()
        asked, self._asked = self._asked, None
        try:
            view = asked.result()
        except RunFailed as error:
            self._fail(str(error))
            return DetectorAnswer(view=None)
        self._failures, self._trouble = 0, ""
        return DetectorAnswer(view=view)

    def document(self) -> SightDocument:
        """Return how things are named at present, for the scene topic."""
        detector = self._loaded.detector
        return {
            "mode": "form" if detector is None or self._trouble else "network",
            "why": self._trouble or self._loaded.why,
            "late": self._late,
            "model": None if detector is None else detector.stats().document(),
        }

    def _late_answer(self) -> DetectorAnswer | None:
        if self._clock.now_ns() - self._asked_ns <= LATE_NS:
            return None
        self._given_up = True
        self._late += 1
        self._trouble = f"no answer within {LATE_NS / NS_PER_S:g} s"
        return DetectorAnswer(view=None)

    def _fail(self, why: str) -> None:
        self._failures += 1
        self._trouble = why
        if self._failures < FAILURES_TO_DISMISS:
            return
        reason = f"{why}; {FAILURES_TO_DISMISS} runs in a row failed, it is asked no more"
        _log.error("degraded: things are named by their form alone: %s", reason)
        self.release(self.replace(LoadedDetector(detector=None, why=reason)))


def _detect(detector: Detector, rgb: Image) -> NetworkView:
    return NetworkView.of(detector.detect(rgb), detector.detection)
