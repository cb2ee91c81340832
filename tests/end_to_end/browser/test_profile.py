"""Take the running robot to another profile from the view Profile."""

import re
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from sim_twin.process_stack import ProcessStack

pytestmark = [pytest.mark.gl, pytest.mark.stack, pytest.mark.timeout(180)]

OTHER = "jetson_orin_nano_8gb"


def choose(page: Page, name: str) -> None:
    page.locator(".profile", has=page.get_by_text(name, exact=True)).click()


@pytest.fixture
def view(pages: Any) -> Page:
    page: Page = pages.of("anna", "profile")
    expect(page.get_by_role("heading", level=1)).to_have_text("Profile")
    return page


def test_the_difference_is_shown_before_anything_changes(view: Page, robot: ProcessStack) -> None:
    before = robot.document("profile_status")["profile"]
    choose(view, OTHER)
    row = view.get_by_role("row", name=re.compile(r"^perception\.memory_mb"))
    expect(row).to_contain_text("400")
    expect(row).to_contain_text("1500")
    assert robot.document("profile_status")["profile"] == before


def test_a_switch_is_confirmed_and_its_end_is_told_with_the_reason(
    view: Page, robot: ProcessStack
) -> None:
    choose(view, OTHER)
    view.get_by_role("button", name="Switch to it").click()
    dialog = view.get_by_role("dialog")
    expect(dialog).to_contain_text("go back to what is in force now")
    dialog.get_by_role("button", name="Switch", exact=True).click()
    assert robot.wait_until(lambda: robot.document("profile_status")["last"], 90.0)
    last = robot.document("profile_status")["last"]
    told = view.get_by_role("region", name="Change of profile")
    expect(told).to_contain_text(last["outcome"])
    expect(told).to_contain_text(last["reason"].split("; ")[0][:60])


def test_a_viewer_may_look_and_not_switch(pages: Any) -> None:
    page: Page = pages.of("vera", "profile")
    choose(page, OTHER)
    expect(page.get_by_role("button", name="Switch to it")).to_be_disabled()
