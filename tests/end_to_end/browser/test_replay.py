"""A page shows a flight as it was, says that no robot is there, and is wound by hand."""

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

pytestmark = [pytest.mark.gl, pytest.mark.stack, pytest.mark.timeout(300)]

FLIGHT = Path(__file__).parents[2] / "vla_deploy/telemetry/flights/estop_while_driving.mcap"
STANDING = ["--pause", "--from", "0.3"]  # driving, before the stop
COMMAND = [sys.executable, "-m", "vla_deploy.cli"]


@pytest.fixture
def replayed() -> Iterator[str]:
    """The address of the page of a flight that is replayed, and stands."""
    with tempfile.TemporaryDirectory(prefix="vla-") as folder:
        process = subprocess.Popen(
            [*COMMAND, "--runtime-base", f"{folder}/base", "replay", str(FLIGHT), *STANDING],
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            assert process.stdout is not None
            told = (line for line in process.stdout if line.startswith("dashboard: "))
            yield next(told).removeprefix("dashboard: ").strip()
        finally:
            with process:  # which closes its pipe
                process.terminate()
                assert process.wait(30) == 0


@pytest.fixture
def replay_page(chromium: Browser, replayed: str) -> Iterator[Page]:
    page = chromium.new_context().new_page()
    page.goto(replayed)
    yield page
    page.context.close()


def test_a_flight_is_shown_paused_wound_to_its_end_and_commands_nobody(replay_page: Page) -> None:
    page = replay_page
    safety = page.get_by_label("Safety state", exact=True)
    bar = page.locator(".notice", has_text=f"Replay of {FLIGHT.name}.")
    expect(bar).to_contain_text("no robot is here")
    expect(safety).to_contain_text("Armed")
    bar.get_by_label("Moment of the recording").fill("1")
    expect(safety).to_contain_text("Emergency stop")
    bar.get_by_label("Speed of the replay").select_option("0.25")
    bar.get_by_role("button", name="Play").click()
    expect(safety).to_contain_text("Disarmed")
    expect(bar).to_contain_text("0:01.2 of 0:01.2")

    page.evaluate("location.hash = '#/command'")
    page.get_by_label("Command in words").fill("go to the kitchen")
    page.get_by_label("Command in words").press("Enter")
    expect(page.get_by_text("this is a replay of").first).to_be_visible()
