"""The status that the alarm rules read is collected from the topics."""

from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.alarms.robot_status import StatusReader
from vla_deploy.ipc import SharedSpace


def test_it_hears_documents_ages_and_the_place_on_the_map(dashboard):
    dashboard.robot.shows("process_table", processes=[])
    pose = {"x_m": 1.0, "y_m": 0.0, "yaw_rad": 0.0, "match_ratio": 0.8754, "state": 1, "doubt": 3}
    dashboard.robot.space.cell_writer("pose").put(**pose, covariance=[0.0] * 9)
    told = StatusReader(dashboard.link).read()
    assert told.document("process_table") == {"processes": []}
    assert told.document("pose") == {
        "state": "unsure", "doubt": "poor_match", "match_ratio": 0.875
    }  # fmt: skip
    assert told.age_s("scan") is None
    assert 0.0 <= (told.age_s("pose") or 0.0) < 10.0


def test_it_counts_late_ticks_over_a_few_seconds_and_anew_for_a_new_control(tmp_path, hand_clock):
    link = RobotLink(tmp_path, hand_clock)
    cell = SharedSpace(tmp_path / "ipc", hand_clock).cell_writer("control_status")
    listener, ratios = StatusReader(link), []
    for tick, late in [(0, 0), (1000, 100), (1250, 150), (2500, 400), (10, 10), (1260, 10)]:
        cell.put_document({"tick": tick, "late_ticks": late})
        ratios.append(listener.read().late_ratio)
        hand_clock.pass_s(5.0 if tick != 1000 else 1.0)
    assert ratios == [None, 0.1, 0.12, 0.2, None, 0.0]
    link.close()
