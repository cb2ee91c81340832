"""Look what a child has before its own code runs."""

import os

import pytest

from platforms import load_profile
from vla_deploy.supervisor.runs.start_settings import nice_of, thread_limits


def test_a_process_that_no_profile_speaks_of_is_as_others_are():
    profile = load_profile("desktop")
    assert nice_of(profile, "twin") == 0
    assert thread_limits(profile, "twin") == {}
    assert nice_of(profile, "dashboard") == profile.processes["dashboard"].nice > 0


@pytest.mark.stack
def test_a_child_is_nice_from_its_start(stage):
    # It sets nothing itself: who has to load a large program before could be in everybody's way.
    with stage.supervisor(stage.row("dashboard"), stage.row("a")) as supervisor:
        supervisor.start()
        (nice,) = stage.pids("dashboard")
        (usual,) = stage.pids("a")
        wanted = load_profile("desktop").processes["dashboard"].nice
        assert os.getpriority(os.PRIO_PROCESS, nice) == wanted
        assert os.getpriority(os.PRIO_PROCESS, usual) == os.getpriority(os.PRIO_PROCESS, 0)
