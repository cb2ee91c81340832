"""See in the view Budgets what the robot uses of its computer."""

import re
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from sim_twin.harness.processes import ProcessStack

pytestmark = [pytest.mark.gl, pytest.mark.stack, pytest.mark.timeout(300)]


@pytest.fixture
def view(pages: Any) -> Page:
    page: Page = pages.of("anna", "budgets")
    expect(page.get_by_role("heading", level=1)).to_have_text("Budgets")
    return page


def test_every_process_is_held_against_its_lines(view: Page, robot: ProcessStack) -> None:
    table = view.get_by_role("region", name="Processes, scrollable")
    for row in robot.document("budget")["rows"]:
        if row["process"] is not None:
            expect(table.get_by_role("rowheader", name=row["process"], exact=True)).to_be_visible()
    expect(table.get_by_role("row", name=re.compile("^control "))).to_contain_text("cores")


def test_missing_is_told_with_its_reason_and_never_as_zero(view: Page, robot: ProcessStack) -> None:
    missing = robot.document("board")["missing"]
    if "power_w" not in missing:
        pytest.skip("this computer measures its power")
    card = view.get_by_role("region", name="Not measured")
    expect(card).to_contain_text(missing["power_w"])


def test_ticks_buses_and_topics_are_counted(view: Page) -> None:
    periods = view.get_by_role("region", name="Control period", exact=True)
    periods.get_by_role("button", name="since start").click()
    expect(periods).to_contain_text(re.compile(r"[\d,]{4,} ticks, [\d,]+ late"))
    buses = view.get_by_role("region", name="Buses")
    expect(buses.get_by_role("heading", name=re.compile("^servos"))).to_be_visible()
    expect(buses).to_contain_text("99 % within")
    topics = view.get_by_role("region", name="Topics, scrollable")
    expect(topics.get_by_role("row", name=re.compile("^joint state"))).to_contain_text("50 ms")


def test_a_span_of_time_is_chosen(view: Page) -> None:
    hour = view.get_by_role("button", name="1 h", exact=True)
    hour.click()
    expect(hour).to_have_attribute("aria-pressed", "true")
    expect(view.get_by_role("region", name="CPU by process")).to_contain_text("control")
