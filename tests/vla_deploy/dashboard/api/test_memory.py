"""What is remembered over HTTP, and how a person corrects it."""

from contextlib import closing

from tests.vla_deploy.dashboard.conftest import Dashboard
from vla_deploy.memory import Episode, EpisodeOutcome, MemoryStore

DONE = EpisodeOutcome.SUCCEEDED


def test_an_outcome_is_corrected_and_found_again(dashboard: Dashboard) -> None:
    with closing(MemoryStore.of_base(dashboard.base)) as store:
        store.add([Episode(told_s=1.0, command="bring me the bottle", outcome=DONE)])
        store.add([Episode(told_s=2.0, command="go to the kitchen", outcome=DONE)])
    judged = dashboard.post(
        "memory/episodes/1/outcome", 200, {"outcome": "failed", "why": "it was the can"}
    )
    assert (judged["outcome"], judged["judged_from"]) == ("failed", "succeeded")
    told = dashboard.get("memory/episodes")
    assert [(one["number"], one["outcome"]) for one in told] == [(2, "succeeded"), (1, "failed")]
    (found,) = dashboard.get("memory/episodes", like="the can")
    assert found["why"] == "it was the can"


def test_what_cannot_be_corrected_is_said(dashboard: Dashboard) -> None:
    dashboard.post("memory/episodes/7/outcome", 404, {"outcome": "failed"})
    dashboard.post("memory/episodes/1/outcome", 422, {"outcome": "refused"})
