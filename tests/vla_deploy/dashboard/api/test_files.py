"""Flights are listed and handed out by name alone."""

import pytest

from vla_deploy.runtime.state_dir import state_dir_of

NAME = "000007-estop.mcap"


@pytest.fixture
def folder(dashboard):
    path = state_dir_of(dashboard.base) / "flights"
    path.mkdir(parents=True)
    (path / NAME).write_bytes(b"flight")
    (path.parent / "secret").write_text("secret")
    (path / "000008-link.mcap").symlink_to(path.parent / "secret")
    (path / ".000009-half.mcap.part").write_bytes(b"half")
    return path


def test_a_flight_is_listed_and_comes_whole(dashboard, folder):
    (flight,) = [one for one in dashboard.get("flights") if one["name"] == NAME]
    assert flight["bytes"] == 6
    answer = dashboard.client.get(f"/api/v1/flights/{NAME}")
    assert answer.content == b"flight"
    assert answer.headers["content-disposition"] == f'attachment; filename="{NAME}"'


def test_a_flight_that_goes_while_it_is_listed_is_left_out(dashboard, folder):
    (folder / "000010-gone.mcap").symlink_to(folder / "nothing")
    names = [one["name"] for one in dashboard.get("flights")]
    assert NAME in names
    assert "000010-gone.mcap" not in names


@pytest.mark.parametrize(
    "name",
    [
        "../secret",
        "..%2fsecret",
        "%2e%2e%2fsecret",
        "..%252fsecret",
        "%2e%2e/%2e%2e/%2e%2e/%2e%2e/etc/passwd",
        "/etc/passwd",
        "%2fetc%2fpasswd",
        "000008-link.mcap",
        ".000009-half.mcap.part",
        "latest",
        "7",
        "%00",
        "000007-estop.mcap%00.txt",
        "..\\secret",
    ],
)
def test_no_name_leads_anywhere_else(dashboard, folder, name):
    answer = dashboard.client.get(f"/api/v1/flights/{name}")
    assert answer.status_code == 404
    assert b"root:" not in answer.content
