"""The Unix socket is opened where it should be, or the error says why not."""

import stat

import pytest

from vla_deploy.dashboard.serving import open_socket
from vla_deploy.runtime.net import PortTaken


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
