"""Sockets are opened where they should be, or it is said why not."""

import socket
import stat

import pytest

from vla_deploy.dashboard.doors import open_port, open_socket
from vla_deploy.dashboard.errors import PortTaken

HOST = "127.0.0.1"


@pytest.fixture
def taken():
    with socket.create_server((HOST, 0)) as other:
        yield other.getsockname()[1]


def test_a_taken_port_is_an_error_that_names_it_and_says_what_to_do(taken):
    with pytest.raises(PortTaken, match=rf"127.0.0.1:{taken}: another program.*ss -ltnp"):
        open_port(HOST, taken, search=False)


def test_where_runs_share_a_computer_the_next_pair_of_ports_is_taken(taken):
    with open_port(HOST, taken, search=True) as found:
        assert found.getsockname()[1] in range(taken + 2, taken + 400, 2)


def test_an_instance_after_the_first_listens_where_open_pages_look(taken):
    with open_port(HOST, taken, search=True) as first:
        before = first.getsockname()[1]
    with open_port(HOST, taken - 40, search=True, before=before) as second:
        assert second.getsockname()[1] == before


@pytest.mark.parametrize("host", ["192.0.2.1", "no.such.host.invalid"])
def test_an_address_that_is_not_this_computers_is_told(host):
    with pytest.raises(PortTaken, match=r"cannot listen there: .*dashboard\.toml"):
        open_port(host, 0, search=True)


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
