"""Take the running robot to another profile from the view Profile."""

import re
from pathlib import Path
from typing import Any, Final

import pytest
from playwright.sync_api import Locator, Page, expect

from sim_twin.harness.processes import ProcessStack

pytestmark = [pytest.mark.gl, pytest.mark.stack, pytest.mark.timeout(300)]

OTHER: Final = "jetson_orin_nano_8gb"
SWITCH_MS: Final = 90_000
LESS_IS_SEEN: Final = 'inherits = "shipped"\nperception_rate_hz = 0.5\n'


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


def switch(view: Page, name: str) -> Locator:
    """Agree to the switch to a profile and return the card that tells its end."""
    choose(view, name)
    view.get_by_role("button", name="Switch to it").click()
    dialog = view.get_by_role("dialog")
    expect(dialog).to_contain_text("go back to what is in force now")
    dialog.get_by_role("button", name="Switch", exact=True).click()
    return view.get_by_role("region", name="Change of profile")


def test_a_switch_that_the_computer_can_keep_changes_the_profile(
    view: Page, robot: ProcessStack
) -> None:
    """Back to what it has begun with: a slow computer cannot keep more than that."""
    begun_with = Path(robot.document("profile_status")["begun_with"])
    other = begun_with.with_name("less_is_seen.toml")
    other.write_text(LESS_IS_SEEN, encoding="utf-8")
    use = ("profile", "use", str(other))
    assert robot.wait_until(lambda: robot.ask(*use).returncode == 0), robot.status()
    computer = view.get_by_role("region", name="This computer")
    expect(computer).to_contain_text(str(other))

    told = switch(view, str(begun_with))
    expect(told).to_contain_text(f"{begun_with} kept", timeout=SWITCH_MS)
    expect(computer).to_contain_text(str(begun_with))
    assert robot.document("profile_status")["profile"] == str(begun_with)
    assert robot.state() == "armed"


def test_a_switch_that_it_cannot_keep_is_refused_with_the_reason(
    view: Page, robot: ProcessStack
) -> None:
    before = robot.document("profile_status")["profile"]
    told = switch(view, OTHER)
    expect(told).to_contain_text(f"{OTHER} refused", timeout=SWITCH_MS)
    status = robot.document("profile_status")
    expect(told).to_contain_text(status["last"]["reason"])
    assert status["last"]["reason"]
    assert status["profile"] == before


def test_a_viewer_may_look_and_not_switch(pages: Any) -> None:
    page: Page = pages.of("vera", "profile")
    choose(page, OTHER)
    expect(page.get_by_role("button", name="Switch to it")).to_be_disabled()
