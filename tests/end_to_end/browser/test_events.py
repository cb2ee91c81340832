"""Read logs, download what was recorded, see who did what."""

from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from playwright.sync_api import Page, expect

from sim_twin.harness.processes import ProcessStack

pytestmark = [pytest.mark.gl, pytest.mark.stack, pytest.mark.timeout(300)]


def test_the_flight_of_a_stop_is_downloaded(
    pages: Any, robot: ProcessStack, tmp_path: Path
) -> None:
    robot.operate("estop")
    page: Page = pages.of("anna", "events/files")
    link = page.get_by_role("link", name="Download").first
    expect(link).to_be_visible()
    with page.expect_download() as download:
        link.click()
    saved = tmp_path / download.value.suggested_filename
    download.value.save_as(saved)
    with saved.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert "control_status" in {channel.topic for channel in summary.channels.values()}


def test_logs_are_filtered_by_process_level_and_words(pages: Any) -> None:
    page: Page = pages.of("anna", "events/logs")
    lines = page.get_by_role("list", name="Log lines").get_by_role("listitem")
    expect(lines.first).to_be_visible()
    page.get_by_label("Process").select_option("supervisor")
    page.get_by_label("Only lines with").fill("dashboard: ready")
    expect(lines).to_have_count(1)
    expect(lines).to_contain_text("supervisor")
    page.get_by_role("button", name="Error", exact=True).click()
    expect(lines).to_have_count(0)


def test_the_audit_is_for_admins_and_names_who_did_what(pages: Any) -> None:
    page: Page = pages.of("anna", "events/audit")
    expect(page.get_by_role("cell", name="anna").first).to_be_visible()
    viewer: Page = pages.of("vera", "events/audit")
    expect(viewer.get_by_role("link", name="Logs")).to_be_visible()
    expect(viewer.get_by_role("link", name="Audit")).to_have_count(0)
