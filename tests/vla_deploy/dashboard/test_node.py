"""The node opens its sockets, publishes where the page is, and isolates its parts."""

import stat

import pytest

from vla_deploy.dashboard.door_probe import SILENT_S, DoorProbe
from vla_deploy.dashboard.node import DashboardNode
from vla_deploy.dashboard.serving import open_socket
from vla_deploy.runtime.net import DashboardSettings, PortTaken
from vla_deploy.runtime.node import NodeContext


class Broken:
    def step(self):
        raise KeyError("cause")

    def stop(self):
        pass


@pytest.fixture
def make(tmp_path, hand_clock):
    made = []

    def node(**settings):
        run_dir = tmp_path / "base" / "20260101-000000-1"
        run_dir.mkdir(parents=True, exist_ok=True)
        context = NodeContext(
            run_dir=run_dir,
            robot="butler",
            profile="desktop",
            devices_dir=tmp_path,  # as in a twin's run: the next free port is taken
            clock=hand_clock,
        )
        made.append(DashboardNode(context, DashboardSettings(**settings)))
        return made[-1]

    yield node
    for one in made:
        one.stop()


def test_it_tells_twice_a_second_where_the_page_is(make, hand_clock):
    node = make()
    node.start()
    node.step()
    told = node.link.document("dashboard_status", 1.0)
    assert told["url"] == f"http://127.0.0.1:{told['port']}"
    hand_clock.pass_s(0.6)
    node.step()
    assert node.link.fresh("dashboard_status").age_s(hand_clock.now_ns()) == 0.0


def test_one_that_listens_everywhere_tells_an_address_that_a_browser_here_finds(make):
    node = make(host="0.0.0.0")
    node.start()
    node.step()
    assert node.link.document("dashboard_status")["url"].startswith("http://127.0.0.1:")


def test_a_broken_part_is_counted_and_told_while_the_others_go_on(make, hand_clock, caplog):
    node = make()
    node.start()
    node.app.state.parts.insert(0, Broken())
    command_id = node.link.utter(text="wave")
    for _ in range(9):
        node.step()
    hand_clock.pass_s(0.6)
    node.step()
    assert node.link.document("dashboard_status")["failures"] == {"Broken": 10}
    assert node.app.state.commands.find(command_id) is not None
    assert [one.message for one in caplog.records if "Broken" in one.message] == [
        "Broken has failed 1 times",
        "Broken has failed 10 times",
    ]


def test_one_that_could_not_start_is_stopped_all_the_same(make):
    with pytest.raises(PortTaken):
        make(host="192.0.2.1").start()


def test_the_unix_socket_is_for_owner_and_group_also_in_a_deep_folder(tmp_path):
    folder = tmp_path / ("deep" * 40)
    folder.mkdir()
    for _ in range(2):  # the second instance of a run finds the first one's
        with open_socket(folder / "dashboard.sock"):
            mode = stat.S_IMODE((folder / "dashboard.sock").stat().st_mode)
            assert mode == 0o660


def test_a_folder_that_cannot_be_written_is_told(tmp_path):
    with pytest.raises(PortTaken, match="cannot listen there"):
        open_socket(tmp_path / "gone" / "dashboard.sock")


def test_a_dashboard_that_answers_nobody_falls_silent_for_the_supervisor(make, hand_clock):
    node = make()
    node.start()
    node.probe = DoorProbe(node.sockets[0].listener, is_tls=False, clock=hand_clock)
    node.step()
    hand_clock.pass_s(SILENT_S + 1)
    node.step()
    told = node.link.fresh("dashboard_status")
    assert told.age_s(hand_clock.now_ns()) > SILENT_S
