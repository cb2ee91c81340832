"""Acts reach control's ring, and are answered by what control then shows."""

import anyio
import pytest
from anyio.to_thread import current_default_thread_limiter
from httpx import ASGITransport, AsyncClient

from vla_deploy.dashboard.api import operate


@pytest.mark.parametrize("body", [None, {"reason": "smoke"}])
def test_stop_presses_the_button_of_every_other_source(dashboard, body):
    assert dashboard.post("stop", status=200, body=body) == {"pressed": True}
    reason = body["reason"] if body else ""
    assert dashboard.robot.hears("operator") == [
        {"act": "estop", "source": "page", "reason": reason}
    ]


async def pressed_while_every_thread_is_held(app):
    threads = current_default_thread_limiter()
    for slow_answer in range(int(threads.total_tokens)):
        threads.acquire_on_behalf_of_nowait(slow_answer)
    async with AsyncClient(transport=ASGITransport(app), base_url="http://robot") as client:
        with anyio.fail_after(2.0):
            return await client.post("/api/v1/stop")


def test_a_stop_waits_for_no_thread_that_slow_answers_hold(dashboard):
    assert anyio.run(pressed_while_every_thread_is_held, dashboard.app).status_code == 200
    assert [told["act"] for told in dashboard.robot.hears("operator")] == ["estop"]


@pytest.mark.parametrize(
    ("act", "state"), [("reset", "disarmed"), ("arm", "armed"), ("disarm", "disarmed")]
)
def test_an_act_is_answered_with_controls_status(dashboard, act, state):
    dashboard.robot.control_is(state)
    told = dashboard.post(act, status=200, body={"reason": "test"})
    assert (told["act"], told["control"]["state"]) == (act, state)
    assert dashboard.robot.hears("operator") == [{"act": act, "source": "page", "reason": "test"}]


def test_an_act_that_control_does_not_carry_out_is_told_with_its_reason(dashboard, monkeypatch):
    monkeypatch.setattr(operate, "_WITHIN_S", 0.05)
    dashboard.robot.control_is("stopped", estop_latched=True, cause="estop", detail="still pressed")
    error = dashboard.post("reset", status=409)["error"]
    assert error["code"] == "no_reset"
    assert error["what"] == "control is still stopped: still pressed"


def test_an_act_while_control_is_away_says_so(dashboard, monkeypatch):
    monkeypatch.setattr(operate, "_WITHIN_S", 0.05)
    error = dashboard.post("arm", status=409)["error"]
    assert error["what"] == "control does not answer"


def test_nothing_but_a_reason_goes_with_an_act(dashboard):
    dashboard.post("arm", status=422, body={"act": "estop"})
    assert dashboard.robot.hears("operator") == []
