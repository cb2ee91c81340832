"""Take images off a source as they come, and keep the newest.

OpenCV has no read that does not wait, for all of its backends, and images that nobody takes queue
up in the kernel and come late. So one thread of the driver's own does nothing but take them. It
ends with the driver: the thread lets go of the source itself, since nothing can interrupt a read
that is under way.
"""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.camera.capture import Capture, Granted, granted, to_rgb
from drivers.clock import Clock
from drivers.errors import DriverError, LinkLost

_NS_PER_MS: Final = 1_000_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Grabbed:
    """Hold one image, its number, when it was there, and the stamp that the backend gave it."""

    rgb: NDArray[np.uint8]
    number: int
    arrival_ns: int
    backend_ns: int


class Grabber:
    """Own a source and the thread that empties it."""

    def __init__(self, connect: Callable[[], Capture], clock: Clock, source: str) -> None:
        """Begin to open the source; whatever goes wrong is told by `newest`."""
        self.granted: Granted | None = None
        self._connect = connect
        self._clock = clock
        self._source = source
        self._lock = threading.Lock()
        self._newest: Grabbed | None = None
        self._failure: DriverError | None = None
        self._stopping = False
        self._thread = threading.Thread(target=self._run, name=f"camera {source}", daemon=True)
        self._thread.start()

    def newest(self) -> Grabbed | None:
        """Return the newest image that was not returned before; never waits.

        Raises:
            DriverError: the source could not be opened, is not what was asked for, or has gone.
        """
        with self._lock:
            newest, self._newest = self._newest, None
            if newest is None and self._failure is not None:
                raise self._failure
        return newest

    def stop(self) -> None:
        """Let the thread end after the read that is under way; stopping twice is allowed."""
        self._stopping = True

    def _run(self) -> None:
        try:
            capture = self._connect()
            try:
                self.granted = granted(capture)
                self._empty(capture)
            finally:
                capture.release()
        except DriverError as error:
            self._fail(error)
        except cv2.error as error:
            self._fail(LinkLost(f"{self._source}: {error}; plug the camera in again"))

    def _empty(self, capture: Capture) -> None:
        number = 0
        while not self._stopping:
            there, image = capture.read()
            if not there:
                raise LinkLost(f"{self._source}: no more images; plug the camera in again")
            grabbed = Grabbed(
                rgb=to_rgb(image),
                number=number,
                arrival_ns=self._clock.now_ns(),
                backend_ns=round(capture.get(cv2.CAP_PROP_POS_MSEC) * _NS_PER_MS),
            )
            number += 1
            with self._lock:
                self._newest = grabbed

    def _fail(self, error: DriverError) -> None:
        with self._lock:
            self._failure = error
