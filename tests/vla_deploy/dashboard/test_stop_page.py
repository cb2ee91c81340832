"""Press the page's stop in a real browser, with a dashboard that hangs or is gone."""

import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect, sync_playwright

from drivers.clock import NS_PER_S, MonotonicClock
from vla_deploy.ipc import SharedSpace

pytestmark = [pytest.mark.stack, pytest.mark.timeout(180)]

READY_NS = 30 * NS_PER_S
CHROMIUM = Path("/usr/bin/chromium")
STATIC = Path(str(files("vla_deploy.dashboard") / "static"))
PAGE = """<!doctype html><html lang="en"><head><title>Robot</title>
<meta name="stop-door" content="http://127.0.0.1:{port}">
<script type="module" src="static/stop.js"></script></head>
<body><button id="stop-button">Stop</button><p id="stop-answer" role="status"></p>
<button data-stop>Stop here, too</button><input aria-label="words"></body></html>"""


class HangingDashboard(ThreadingHTTPServer):
    """Serve the page, and hang on everything that is asked of it."""

    daemon_threads = True

    def __init__(self, door_port: int) -> None:
        self.goes_on = threading.Event()
        self.stop_asked = threading.Event()
        self.page = PAGE.format(port=door_port).encode()
        super().__init__(("127.0.0.1", 0), _Handler)


class _Handler(SimpleHTTPRequestHandler):
    server: HangingDashboard

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, directory=str(STATIC.parent), **kwargs)

    def do_GET(self) -> None:
        if self.path != "/":
            super().do_GET()
            return
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(self.server.page)

    def do_POST(self) -> None:
        self.server.stop_asked.set()
        self.server.goes_on.wait(30)

    def log_message(self, *_: Any) -> None:
        """Keep the terminal for the tests."""


class Robot:
    """Stand beside a stop door as control does: read what is pressed, tell what comes of it."""

    def __init__(self, run_dir: Path) -> None:
        self.space = SharedSpace(run_dir / "ipc", MonotonicClock())
        self._operator = self.space.ring_reader("operator", from_start=False)
        self._status = self.space.cell_writer("control_status")
        self.tell("armed")

    def pressed(self) -> list[str]:
        return [event.payload["source"] for event in self._operator.drain()]

    def tell(self, state: str) -> None:
        self._status.put_document({"state": state, "estop_latched": state == "stopped"})


@pytest.fixture(scope="module")
def run_dir(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("run")
    words = ("-m", "vla_deploy.stop_door", "--robot", "butler", "--profile", "desktop")
    door = subprocess.Popen(
        [sys.executable, *words, "--run-dir", str(folder), "--devices-dir", str(folder)],
        stderr=subprocess.DEVNULL,
    )
    _await_ready(folder / "ready" / "stop_door")
    yield folder
    door.terminate()
    assert door.wait(10) == 0


def _await_ready(file: Path) -> None:
    clock = MonotonicClock()
    deadline_ns = clock.now_ns() + READY_NS
    while not file.exists():
        assert clock.now_ns() < deadline_ns, f"{file} does not appear"
        clock.sleep_until(clock.now_ns() + NS_PER_S // 50)


@pytest.fixture(scope="module")
def robot(run_dir: Path) -> Iterator[Robot]:
    robot = Robot(run_dir)
    yield robot
    robot.space.close()


@pytest.fixture
def dashboard(robot: Robot) -> Iterator[HangingDashboard]:
    told = robot.space.cell_reader("stop_door_status").latest()
    assert told is not None
    with HangingDashboard(told.document()["port"]) as served:
        threading.Thread(target=served.serve_forever, daemon=True).start()
        yield served
        served.goes_on.set()
        served.shutdown()


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    if not CHROMIUM.exists():
        pytest.skip(f"needs {CHROMIUM}: install the package chromium")
    with (
        sync_playwright() as playwright,
        closing(
            playwright.chromium.launch(executable_path=str(CHROMIUM), args=["--no-sandbox"])
        ) as browser,
    ):
        yield browser


@pytest.fixture
def page(browser: Any, dashboard: HangingDashboard) -> Iterator[Page]:
    with closing(browser.new_page()) as page:
        page.goto(f"http://127.0.0.1:{dashboard.server_port}/")
        yield page


def test_with_a_hanging_dashboard_the_stop_door_stops_and_control_confirms(page, robot, dashboard):
    robot.tell("armed")
    page.click("#stop-button")
    answer = page.locator("#stop-answer")
    expect(answer).to_contain_text("the stop door after")
    expect(answer).not_to_contain_text("the dashboard")
    assert robot.pressed()[0] == "page"
    assert dashboard.stop_asked.wait(20)  # the page asks both; the door may answer first
    robot.tell("stopped")
    expect(answer).to_contain_text("Stopped. Pressed: the stop door after")
    expect(page.locator("html")).to_have_attribute("data-stop-state", "stopped")


def test_with_a_dashboard_that_is_gone_too(page, robot, dashboard):
    dashboard.shutdown()
    dashboard.server_close()
    robot.tell("stopped")
    page.click("[data-stop]")
    expect(page.locator("#stop-answer")).to_contain_text("Stopped. Pressed: the stop door after")
    assert "page" in robot.pressed()


@pytest.mark.parametrize("keys", [("Control+.",), ("Escape", "Escape")])
def test_the_keys_press_also_while_somebody_types(page, robot, keys):
    page.focus("input")
    robot.tell("stopped")
    for key in keys:
        page.keyboard.press(key)
    expect(page.locator("#stop-answer")).to_contain_text("Stopped")


def test_a_robot_that_says_nothing_sends_the_person_to_its_own_button(page, robot):
    robot.tell("armed")
    page.click("#stop-button")
    expect(page.locator("#stop-answer")).to_contain_text(
        "control does not say that it stopped. Press the emergency stop button on the robot."
    )
