"""Ask the network what an image shows, beside the steps; do without it when it fails.

The rule of doing without: a robot whose network cannot be opened, fails, or takes too long goes on
by form alone, and says so; what stands in its way and where it is never depend on the network. A
change that would take the network away from a robot that has one is refused instead.
"""

import logging
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import Any, Final

from drivers.clock import NS_PER_S, Clock
from platforms import Profile
from vla_deploy.inference.errors import InferenceError, RunFailed
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.perception.detectors.detector import ROLE, Detector, open_detector
from vla_deploy.perception.detectors.image_input import Image
from vla_deploy.perception.images.network_view import NetworkView
from vla_deploy.runtime.one_line import one_line

LATE_NS: Final = NS_PER_S
"""An image is looked at by form alone when the network has not answered within this time."""
FAILURES_TO_DISMISS: Final = 3
"""Runs in a row after which a network is asked no more."""
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class Network:
    """Hold an open detector, or why there is none."""

    detector: Detector | None
    why: str = ""

    def close(self) -> None:
        """Release the memory; a run that is under way ends by itself."""
        if self.detector is not None:
            self.detector.close()


@dataclass(frozen=True, slots=True)
class DetectorAnswer:
    """Hold what a network saw; None where there is none, it failed, or it took too long."""

    view: NetworkView | None


def open_network(
    shelf: ModelShelf, profile: Profile, model_tier: int, *, instead_of_one: bool = False
) -> Network:
    """Open the detector that a profile chooses; where it has none, say why there is none.

    Raises:
        InferenceError: it cannot be opened, and the profile requires it, or it would take the place
            of one that is at work.
    """
    choice = profile.models.get(ROLE)
    if choice is None:
        return Network(detector=None, why=f"profile {profile.name} names no detector")
    try:
        return Network(detector=open_detector(shelf, profile, model_tier))
    except InferenceError as error:
        if choice.required or instead_of_one:
            raise
        _log.error("degraded: things are named by their form alone: %s", error)
        return Network(detector=None, why=one_line(error))


class Eyes:
    """Hold the network at work, and ask it about one image at a time."""

    def __init__(self, executor: Executor, clock: Clock) -> None:
        """Take an executor of one thread over, or one that works at once."""
        self._executor = executor
        self._clock = clock
        self._network = Network(detector=None, why="not opened yet")
        self._asked: Future[NetworkView] | None = None
        self._asked_ns = 0
        self._given_up = False
        self._closed = False
        self._failures = 0
        self._late = 0
        self._trouble = ""

    @property
    def network(self) -> Network:
        """Return what is at work."""
        return self._network

    def take(self, network: Network) -> Network:
        """Put another network to work from the next image on; return the one before."""
        before, self._network = self._network, network
        self._failures, self._trouble = 0, ""
        return before

    def release(self, network: Network) -> None:
        """Close a network that is at work no more, behind what it was asked last."""
        if self._closed:
            network.close()
        else:
            self._executor.submit(network.close)

    def close(self) -> None:
        """Release everything; an answer under way is given up."""
        self._closed = True
        self._executor.shutdown(wait=False, cancel_futures=True)
        self._network.close()

    def ask(self, rgb: Image) -> None:
        """Ask about an image, unless the last answer is still under way."""
        if self._given_up and self._asked is not None and self._asked.done():
            self._asked, self._given_up = None, False
        detector = self._network.detector
        if detector is not None and self._asked is None:
            self._asked_ns = self._clock.now_ns()
            self._asked = self._executor.submit(_look, detector, rgb)

    def answer(self) -> DetectorAnswer | None:
        """Return what the network saw in the image that was asked about last; None: wait on."""
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

    def document(self) -> dict[str, Any]:
        """Return how things are named at present, as the scene topic tells it."""
        detector = self._network.detector
        return {
            "mode": "form" if detector is None or self._trouble else "network",
            "why": self._trouble or self._network.why,
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
        told = f"{why}; {FAILURES_TO_DISMISS} runs in a row failed, it is asked no more"
        _log.error("degraded: things are named by their form alone: %s", told)
        self.release(self.take(Network(detector=None, why=told)))


def _look(detector: Detector, rgb: Image) -> NetworkView:
    return NetworkView.of(detector.detect(rgb), detector.detection)
