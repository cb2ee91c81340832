"""Log in and out; the stop button needs neither."""

from typing import Any

import pytest
from playwright.sync_api import Page, expect

from sim_twin.harness.processes import ProcessStack

pytestmark = [pytest.mark.gl, pytest.mark.stack, pytest.mark.timeout(300)]


def test_who_is_unknown_sees_nothing_but_login_and_stop(pages: Any, robot: ProcessStack) -> None:
    page: Page = pages.fresh()
    expect(page.get_by_label("User")).to_be_focused()
    page.get_by_label("User").fill("anna")
    page.get_by_label("Password").fill("guessed")
    page.keyboard.press("Enter")
    expect(page.get_by_role("alert")).not_to_be_empty()
    expect(page.get_by_label("Safety state", exact=True)).to_have_count(0)
    page.get_by_role("button", name="Stop", exact=True).click()
    assert robot.wait_until(lambda: robot.document("control_status")["estop_latched"])


def test_an_operator_logs_in_and_out(pages: Any) -> None:
    page: Page = pages.fresh()
    page.get_by_label("User").fill("anna")
    page.get_by_label("Password").fill("five-words-that-nobody-guesses")
    page.get_by_role("button", name="Log in").click()
    expect(page.get_by_label("Safety state", exact=True)).to_be_visible()
    page.get_by_role("button", name="Log out").click()
    expect(page.get_by_label("User")).to_be_visible()
