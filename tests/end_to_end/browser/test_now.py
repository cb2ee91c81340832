"""Stop, reset and arm the robot from the view Now, and see why it stopped."""

import re
from typing import Any

import pytest
from playwright.sync_api import Locator, Page, expect

from sim_twin.harness.processes import ProcessStack

pytestmark = [pytest.mark.gl, pytest.mark.stack, pytest.mark.timeout(300)]

MOVING_RAD_S = 1.0
STANDSTILL_RAD_S = 0.05


def safety(page: Page) -> Locator:
    return page.get_by_label("Safety state", exact=True)


def activity(page: Page) -> Locator:
    return page.get_by_role("banner").locator(".activity")


def act(page: Page, name: str, *, agreed: bool = True) -> None:
    safety(page).get_by_role("button", name=name, exact=True).click()
    if agreed:
        page.get_by_role("dialog").get_by_role("button", name=name, exact=True).click()


def drive(page: Page, robot: ProcessStack) -> None:
    page.evaluate("location.hash = '#/command'")
    page.get_by_label("Command in words").fill("go to the kitchen")
    page.get_by_label("Command in words").press("Enter")
    assert robot.wait_until(lambda: robot.fastest_rad_s() > MOVING_RAD_S), robot.status()


def stands(robot: ProcessStack) -> bool:
    return robot.wait_until(lambda: robot.fastest_rad_s() < STANDSTILL_RAD_S, 5.0)


def test_stop_ends_the_motion_and_reset_and_arm_are_two_acts(
    page: Page, robot: ProcessStack
) -> None:
    expect(safety(page)).to_contain_text("Armed")
    drive(page, robot)
    expect(activity(page)).to_contain_text("navigating")
    page.get_by_role("button", name="Stop", exact=True).click()
    expect(activity(page)).to_contain_text("stopped")
    assert stands(robot), robot.truth()
    page.evaluate("location.hash = '#/now'")
    expect(safety(page)).to_contain_text("Emergency stop latched")
    expect(safety(page)).to_contain_text("Stopped")
    expect(safety(page).get_by_role("button", name="Arm", exact=True)).to_be_disabled()

    act(page, "Reset")
    expect(safety(page)).to_contain_text("Disarmed")
    assert stands(robot)
    act(page, "Arm")
    expect(safety(page)).to_contain_text(re.compile("^Armed"))
    expect(activity(page)).to_contain_text("idle")
    assert robot.state() == "armed"


def test_a_page_whose_server_hangs_shows_no_value_as_live_and_still_stops(
    page: Page, robot: ProcessStack
) -> None:
    drive(page, robot)
    page.evaluate("location.hash = '#/now'")
    expect(safety(page)).to_contain_text("Armed")
    robot.freeze("dashboard")
    try:
        expect(safety(page)).to_contain_text("Unknown")
        page.keyboard.press("Control+.")
        assert stands(robot), robot.truth()
        expect(page.get_by_text("No live data for")).to_be_visible()
    finally:
        robot.thaw("dashboard")
    expect(safety(page)).to_contain_text("Emergency stop latched")
    expect(page.get_by_text("No live data for")).to_be_hidden()


def test_a_viewer_may_stop_and_nothing_else(pages: Any, robot: ProcessStack) -> None:
    page = pages.of("vera")
    disarm = safety(page).get_by_role("button", name="Disarm")
    expect(disarm).to_be_disabled()
    expect(disarm).to_have_attribute("title", "Needs the role operator")
    page.get_by_role("button", name="Stop", exact=True).click()
    expect(safety(page)).to_contain_text("Emergency stop latched")
    assert robot.state() in ("stopping", "stopped")
