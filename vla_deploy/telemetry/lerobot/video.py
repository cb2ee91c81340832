"""Encode the images of one camera into MP4 files, one image at a time."""

from fractions import Fraction
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from vla_deploy.telemetry.errors import DatasetRefused, ExtraMissing
from vla_deploy.telemetry.lerobot.layout import VIDEO, FilePlace, extra
from vla_deploy.telemetry.lerobot.statistics import FeatureStatistics, ImageStatistics

Image = NDArray[np.uint8]
MB: Final = 1024 * 1024

# As LeRobot has them (configs/video.py): every other frame is whole, so that training finds any.
_ENCODERS: Final[tuple[tuple[str, str, dict[str, str]], ...]] = (
    ("libx264", "h264", {"g": "2", "bf": "0", "crf": "23", "preset": "veryfast"}),
    ("libsvtav1", "av1", {"g": "2", "crf": "30", "preset": "12"}),
)
PIXELS: Final = "yuv420p"
_THREADS: Final = 2


class VideoFile:
    """Write one MP4 file; frame k is shown at k / fps."""

    def __init__(self, path: Path, fps: int, width: int, height: int) -> None:
        """Begin the file.

        Raises:
            DatasetRefused: images of that size cannot be encoded.
            ExtraMissing: PyAV is missing, or has no encoder.
        """
        if width % 2 or height % 2:
            raise DatasetRefused(
                f"{path.name}: images of {width} x {height}: expected even numbers, as {PIXELS} has"
            )
        self.path = path
        self.frames = 0
        self.size_bytes = 0
        """Of what has been encoded; the file itself is written in large pieces."""
        self._size = (height, width)
        self._av = av = extra("av")
        encoder, self.codec, options = _encoder(av)
        path.parent.mkdir(parents=True, exist_ok=True)
        self._container = av.open(str(path), "w", options={"movflags": "+faststart"})
        self._stream: Any = self._container.add_stream(encoder, rate=fps, options=options)
        self._stream.width, self._stream.height, self._stream.pix_fmt = width, height, PIXELS
        self._stream.codec_context.time_base = Fraction(1, fps)
        self._stream.codec_context.thread_count = _THREADS

    def add(self, rgb: Image, *, begins: bool) -> None:
        """Add an image; the one that `begins` an episode is whole.

        Raises:
            DatasetRefused: it has another size than those before.
        """
        if rgb.shape[:2] != self._size:
            height, width = self._size
            raise DatasetRefused(
                f"{self.path.name}: an image of {rgb.shape[1]} x {rgb.shape[0]}, expected "
                f"{width} x {height} as before: export them apart"
            )
        frame = self._av.VideoFrame.from_ndarray(np.ascontiguousarray(rgb), format="rgb24")
        frame.pts = self.frames
        if begins:
            frame.pict_type = self._av.video.frame.PictureType.I
        self.frames += 1
        self._mux(frame)

    def close(self) -> None:
        """Finish the file."""
        if self.frames:
            self._mux(None)
        self._container.close()

    def _mux(self, frame: Any) -> None:
        for packet in self._stream.encode(frame):
            self.size_bytes += packet.size
            self._container.mux(packet)


def _encoder(av: Any) -> tuple[str, str, dict[str, str]]:
    for encoder, codec, options in _ENCODERS:
        if encoder in av.codecs_available:
            return encoder, codec, options
    names = ", ".join(encoder for encoder, _, _ in _ENCODERS)
    raise ExtraMissing(f"this PyAV has none of {names}; take its wheel: pip install --force av")


class CameraVideo:
    """Write the video files of one camera: one goes on over episodes until it is large enough."""

    def __init__(self, folder: Path, key: str, fps: int, file_mb: float) -> None:
        self.key = key
        self._folder = folder
        self._fps = fps
        self._file_bytes = file_mb * MB
        self._place = FilePlace()
        self._file: VideoFile | None = None
        self._from_frame = 0
        self._counted = ImageStatistics()
        self._feature: dict[str, Any] = {}

    def add(self, rgb: Image, *, begins: bool) -> None:
        """Add an image; one that `begins` an episode goes into a new file where one is full.

        Raises:
            DatasetRefused: it does not fit to those before.
            ExtraMissing: PyAV is missing, or has no encoder.
        """
        if self._file is None:
            height, width = rgb.shape[:2]
            path = self._folder / self._place.path(VIDEO, video_key=self.key)
            self._file = VideoFile(path, self._fps, width, height)
            self._feature = _feature(self._file.codec, self._fps, width, height)
        if begins:
            self._from_frame = self._file.frames
            self._counted = ImageStatistics()
        self._counted.add(rgb)
        self._file.add(rgb, begins=begins)

    def end_episode(self) -> tuple[dict[str, Any], FeatureStatistics]:
        """Return where the episode is, as columns of its table, and its statistics."""
        assert self._file is not None
        prefix = f"videos/{self.key}"
        row = {
            f"{prefix}/chunk_index": self._place.chunk_index,
            f"{prefix}/file_index": self._place.file_index,
            f"{prefix}/from_timestamp": self._from_frame / self._fps,
            f"{prefix}/to_timestamp": self._file.frames / self._fps,
        }
        if self._file.size_bytes >= self._file_bytes:
            self.close()
            self._place = self._place.following
        return row, self._counted.result()

    def feature(self) -> dict[str, Any]:
        """Return the camera's feature, as info.json has it."""
        return self._feature

    def close(self) -> None:
        """Finish the file under way."""
        if self._file is not None:
            self._file.close()
            self._file = None


def _feature(codec: str, fps: int, width: int, height: int) -> dict[str, Any]:
    return {
        "dtype": "video",
        "shape": [height, width, 3],
        "names": ["height", "width", "channels"],
        "info": {
            "video.height": height,
            "video.width": width,
            "video.codec": codec,
            "video.pix_fmt": PIXELS,
            "video.fps": fps,
            "video.channels": 3,
            "video.is_depth_map": False,
            "is_depth_map": False,
            "has_audio": False,
        },
    }
