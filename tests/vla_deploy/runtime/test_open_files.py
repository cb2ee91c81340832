import os
import resource

import pytest

from vla_deploy.runtime import open_files


@pytest.mark.parametrize(
    ("limits", "raised"),
    [((256, 300), 300), ((256, 100_000), 4096), ((9000, 9000), None), ((256, 256), None)],
)
def test_the_limit_rises_as_far_as_permitted_and_never_falls(monkeypatch, limits, raised):
    set_to = []
    monkeypatch.setattr(open_files.resource, "getrlimit", lambda _: limits)
    monkeypatch.setattr(open_files.resource, "setrlimit", lambda _, to: set_to.append(to))
    open_files.raise_open_files()
    assert set_to == ([] if raised is None else [(raised, limits[1])])


def test_what_is_open_is_counted():
    left = open_files.open_files_left()
    with open("/dev/null"):  # noqa: PTH123
        assert open_files.open_files_left() == left - 1
    assert left < resource.getrlimit(resource.RLIMIT_NOFILE)[0]


@pytest.mark.parametrize(("before", "mode"), [(0o022, 0o640), (0o077, 0o600), (0, 0o640)])
def test_new_files_are_not_for_other_users(tmp_path, before, mode):
    own = os.umask(before)
    try:
        open_files.keep_files_private()
        (tmp_path / "log").touch()
    finally:
        os.umask(own)
    assert (tmp_path / "log").stat().st_mode & 0o777 == mode
