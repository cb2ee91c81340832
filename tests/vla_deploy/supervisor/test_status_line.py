"""Who reads the status line learns from its words alone whether something is in trouble."""

import pytest

from vla_deploy.supervisor.processes.lifecycle import ProcessRecord, ProcessState
from vla_deploy.supervisor.status_line import status_line, trouble_in, with_late

READY = ProcessRecord(state=ProcessState.READY)


@pytest.mark.parametrize(
    "state", [ProcessState.BACKOFF, ProcessState.GIVEN_UP, ProcessState.ABORTING]
)
def test_a_process_that_fails_is_trouble(state: ProcessState) -> None:
    failing = ProcessRecord(state=state, reason="exit code 1")
    status = status_line({"control": READY, "planner": failing}, stopping=False)
    assert status == f"degraded: planner {state.value} (exit code 1)"
    assert trouble_in(status) == status


def test_what_is_late_is_trouble() -> None:
    status = with_late("all 9 processes ready", ["bus arm: lost 3", "supervisor: held up"])
    assert trouble_in(status) == status == "all 9 processes ready; not in time: bus arm: lost 3"


@pytest.mark.parametrize(
    ("state", "status"),
    [
        (ProcessState.READY, "all 2 processes ready"),
        (ProcessState.STARTING, "starting planner: 1 of 2 ready"),
        (ProcessState.OFF, "all 1 processes ready"),
    ],
)
def test_what_starts_or_is_off_is_no_trouble_nor_is_another_profile(
    state: ProcessState, status: str
) -> None:
    records = {"control": READY, "planner": ProcessRecord(state=state)}
    told = status_line(records, stopping=False, fault="the chosen profile x does not load")
    assert told == f"{status}; the chosen profile x does not load"
    assert trouble_in(with_late(told, [])) == ""
