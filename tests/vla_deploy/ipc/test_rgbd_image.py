"""The pixels of a colour and depth frame."""

import numpy as np
import pytest

from vla_deploy.ipc.errors import BadPayload
from vla_deploy.ipc.memory.frame_ring import Frame
from vla_deploy.ipc.rgbd_image import colours, depths_m, depths_mm


def frame(payload: bytes) -> Frame:
    return Frame(payload=payload, width=2, height=1, stamp_ns=1, sequence=1, writer_pid=1)


def test_colours_come_first_then_depths_in_millimetres() -> None:
    depth = np.array([1500, 0], "<u2")
    image = frame(bytes(range(6)) + depth.tobytes())
    assert colours(image).tolist() == [[[0, 1, 2], [3, 4, 5]]]
    assert depths_mm(image).tolist() == [[1500, 0]]
    assert depths_m(image) == pytest.approx(np.array([[1.5, 0.0]]))


@pytest.mark.parametrize("read", [colours, depths_mm, depths_m])
def test_a_frame_of_another_size_than_it_says_is_refused(read: object) -> None:
    with pytest.raises(BadPayload, match="2 x 1 has 9 bytes, expected 10"):
        read(frame(bytes(9)))  # type: ignore[operator]
