"""Show what no message should be: it is left out and counted, and the next one is shown."""

from typing import Any

import pytest

from vla_deploy.telemetry.rerun.entity_logger import EntityLogger

GOOD = b'{"v_m_s": 0.1, "w_rad_s": 0.2}'
STILL = (
    b'{"frame_id": "camera", "K": [1, 0, 0, 0, 1, 0, 0, 0, 1], "width": %d, "height": 4, "D": []}'
)


@pytest.mark.parametrize(
    ("channel", "text"),
    [
        ("base_command", b"\xff no JSON"),
        ("base_command", b"[1, 2]"),
        ("base_command", b'{"v_m_s": "fast"}'),
        ("base_command", b'{"v_m_s": {}}'),
        ("joint_state", b'{"joint_count": null, "position": [1]}'),
        ("joint_state", b'{"joint_count": 2, "position": 4}'),
        ("control_status", b'{"joints": 5}'),
        ("view/frames", b'{"transforms": [{"parent_frame_id": "moon"}]}'),
        ("view/frames", b'{"transforms": 3}'),
        (
            "view/base_frame",
            b'{"transforms": [{"parent_frame_id": "moon", "child_frame_id": "x"}]}',
        ),
        ("view/scan", b'{"ranges": [[1]], "start_angle": 0, "end_angle": 1}'),
        ("view/near_obstacles", b'{"fields": [], "data": "", "point_stride": 12}'),
        ("view/scene", b'{"entities": [{"id": "x", "frame_id": "map"}]}'),
        ("view/map", b'{"column_count": 7, "data": "AAAA"}'),
        ("view/log", b'{"message": "x", "level": 99, "name": "y"}'),
        ("rgbd/colour", b'{"frame_id": "camera", "format": "jpeg", "data": "not base 64"}'),
        ("tick_record", b'{"record": "AAAA"}'),
        ("task_event", b"\xff"),
    ],
)
def test_what_does_not_fit_is_left_out_and_counted(taken: Any, channel: str, text: bytes) -> None:
    logger = EntityLogger(taken)
    logger.add(channel, 1, text)
    logger.add("base_command", 2, GOOD)
    assert logger.unfit == {channel: 1}
    assert taken.counts == {"plots/base_command/v_m_s": 1, "plots/base_command/w_rad_s": 1}
    assert taken.counts == logger.shown


def test_only_the_first_of_its_kind_is_told(taken: Any, caplog: pytest.LogCaptureFixture) -> None:
    logger = EntityLogger(taken)
    for _ in range(3):
        logger.add("base_command", 1, b"nothing")
    assert logger.unfit.total() == 3
    assert [record.message.split(":")[0] for record in caplog.records] == ["base_command"]


def test_what_stays_is_told_once_until_it_is_another(taken: Any) -> None:
    logger = EntityLogger(taken)
    for width in (3, 3, 5):
        logger.add("view/lens", 1, STILL % width)
    assert [one.values["resolution"] for one in taken.of("world/base/camera")] == [[3, 4], [5, 4]]
