"""Type and say commands, watch their plans, read why one was refused, answer, cancel."""

import json
import re
from typing import Any

import pytest
from playwright.sync_api import Locator, Page, expect

from sim_twin.harness.processes import ProcessStack

pytestmark = [pytest.mark.gl, pytest.mark.stack, pytest.mark.timeout(300)]

STANDSTILL_RAD_S = 0.05


@pytest.fixture
def page(pages: Any) -> Page:
    page: Page = pages.of("anna", "command")
    return page


def give(page: Page, text: str) -> Locator:
    """Type a command and return the card that shows it."""
    page.get_by_label("Command in words").fill(text)
    page.get_by_role("button", name="Send").click()
    card = page.locator(".card", has=page.locator(".said-words", has_text=text))
    expect(card.first).to_be_visible()
    return card.first


def test_a_typed_command_is_watched_to_its_end(page: Page, robot: ProcessStack) -> None:
    before = robot.truth()["robot"]["yaw_rad"]
    card = give(page, "turn left 30 degrees")
    step = card.get_by_label("Plan").get_by_role("listitem").last  # a retry adds one
    expect(step).to_contain_text("turn")
    expect(step).to_contain_text("done")
    expect(step).to_contain_text(re.compile(r"\d s|\d ms"))
    expect(card.locator(".card-head")).to_contain_text("Done")
    expect(page.get_by_role("button", name="turn left 30 degrees")).to_contain_text("Done")
    assert robot.truth()["robot"]["yaw_rad"] - before == pytest.approx(0.52, abs=0.2)


def test_a_refusal_says_why_in_words(page: Page) -> None:
    card = give(page, "bring me the moon")
    expect(card).to_contain_text("Refused: nothing was done.")
    expect(card.locator(".notice")).to_contain_text("moon")


def test_whether_it_could_do_something_is_measured_and_nothing_moves(
    page: Page, robot: ProcessStack
) -> None:
    composer = page.get_by_role("region", name="Give a command")
    page.get_by_label("Command in words").fill("go to the kitchen")
    composer.get_by_role("button", name="Could you?").click()
    expect(composer.locator(".notice")).to_contain_text("It can be done.")
    assert robot.fastest_rad_s() < STANDSTILL_RAD_S
    page.get_by_label("Command in words").fill("go to the")
    expect(composer.locator(".notice")).to_have_count(0)  # it judged other words


def test_what_the_robot_asks_is_answered_by_a_button(page: Page) -> None:
    card = give(page, "turn left 20 degrees unless it rains")
    question = card.get_by_label("The robot asks")
    expect(question).to_contain_text("unless")
    question.get_by_role("button", name="no", exact=True).click()
    expect(question).to_have_count(0)


def test_an_admin_leases_the_robot_to_agents_and_takes_it_back(page: Page) -> None:
    card = page.get_by_role("region", name="AI agents")
    expect(card).to_contain_text("may read and stop")
    card.get_by_role("button", name="5 min", exact=True).click()
    card.get_by_role("button", name="Lease the robot").click()
    page.get_by_role("dialog").get_by_role("button", name="Lease", exact=True).click()
    expect(card).to_contain_text("5 min yet, by leave of anna")
    card.get_by_role("button", name="Take it back").click()
    expect(card).to_contain_text("may read and stop")


def test_a_command_is_cancelled_and_the_robot_stays_ready(page: Page, robot: ProcessStack) -> None:
    card = give(page, "go to the kitchen")
    expect(card.locator("[data-status=active]")).to_be_visible()
    card.get_by_role("button", name="Cancel").click()
    expect(card.locator(".card-head")).to_contain_text("Cancelled")
    assert robot.wait_until(lambda: robot.fastest_rad_s() < STANDSTILL_RAD_S, 5.0)
    assert robot.state() == "armed"


def test_a_command_said_into_the_browser_is_heard_and_planned(page: Page) -> None:
    talk = page.get_by_role("button", name="Hold to talk")
    talk.hover()
    page.mouse.down()
    expect(page.get_by_role("button", name="Listening")).to_be_visible()
    heard = page.locator(".heard")
    expect(heard).to_contain_text("left")
    page.mouse.up()
    expect(heard).to_contain_text("accepted")
    expect(page.locator(".card", has_text="by voice").first).to_contain_text("turn")


def test_what_is_forbidden_for_good_is_shown_until_it_is_permitted(page: Page) -> None:
    told = page.locator(".notice", has_text="Told not to touch the keys")
    give(page, "don't touch the keys")
    expect(told).to_be_visible()
    question = give(page, "you may touch the keys again").get_by_label("The robot asks")
    expect(question).to_contain_text("May I touch the keys again?")
    expect(told).to_be_visible()
    question.get_by_role("button", name="yes", exact=True).click()
    expect(told).to_have_count(0)


def mission(page: Page, goal: str) -> Locator:
    """Give several commands at once, and return what shows them."""
    give(page, goal)
    return page.locator(".mission", has_text=goal)


def test_a_mission_shows_its_objectives_and_what_each_part_of_the_robot_did(page: Page) -> None:
    shown = mission(page, "turn left 20 degrees; look left")
    expect(shown.locator("summary").first).to_contain_text("Done")
    rows = shown.get_by_label("Objectives").locator("> li")
    expect(rows).to_have_count(2)
    for row, words in zip(rows.all(), ("turn left 20 degrees", "look left"), strict=True):
        expect(row).to_contain_text(words)
        expect(row).to_contain_text("done")
    lanes = shown.get_by_role("region", name="What each part did when")
    expect(lanes.get_by_label("Base").get_by_role("listitem")).to_contain_text("turn")
    expect(lanes.get_by_label("Head").get_by_role("listitem").last).to_contain_text("done, from 0:")
    shown.get_by_text("As a table").click()
    expect(
        shown.get_by_role("row", name=re.compile("^turn turn left 20 degrees base"))
    ).to_be_visible()
    history = page.get_by_role("region", name="History")
    expect(history.get_by_role("button", name="look left")).to_have_count(1)  # and not its parts


def test_a_mission_is_paused_goes_on_and_is_cancelled(page: Page, robot: ProcessStack) -> None:
    document = {"goal": "a walk", "objectives": ["go to the kitchen", "turn left 25 degrees"]}
    page.get_by_text("Give a plan or a mission as JSON").click()
    page.get_by_label("Plan or mission as JSON").fill(json.dumps(document))
    page.get_by_role("button", name="Check it, then run it").click()
    shown = page.locator(".mission", has_text="a walk")
    assert robot.wait_until(lambda: robot.fastest_rad_s() > STANDSTILL_RAD_S), robot.status()
    shown.get_by_role("button", name="Pause").click()
    expect(shown.locator("summary").first).to_contain_text("Paused")
    assert robot.wait_until(lambda: robot.fastest_rad_s() < STANDSTILL_RAD_S, 5.0)
    shown.get_by_role("button", name="Resume").click()
    expect(shown.locator("summary").first).to_contain_text("Running")
    assert robot.wait_until(lambda: robot.fastest_rad_s() > STANDSTILL_RAD_S), robot.status()
    shown.get_by_role("button", name="Cancel the mission").click()
    expect(shown.locator("summary").first).to_contain_text("Cancelled")
    assert robot.wait_until(lambda: robot.fastest_rad_s() < STANDSTILL_RAD_S, 5.0)
    expect(shown.get_by_role("button", name="Cancel the mission")).to_have_count(0)
