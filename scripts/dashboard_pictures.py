"""Take the pictures of the dashboard for the docs: `python scripts/dashboard_pictures.py`.

A twin works on a command while each view is looked at by a phone and by a desktop.
"""

import argparse
import logging
import tempfile
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from playwright.sync_api import Browser, Page, ViewportSize, sync_playwright

from sim_twin.harness.processes import ProcessStack
from sim_twin.harness.robot import RobotFailed
from vla_deploy.client.access.login_link import login_url
from vla_deploy.ipc import topics

VIEWS: Final = ("now", "robot", "command", "budgets", "events", "profile")
SIZES: Final = {
    "phone": ViewportSize(width=390, height=844),
    "desktop": ViewportSize(width=1440, height=900),
}
THEMES: Final = {"phone": "light", "desktop": "dark"}
MOST_BYTES: Final = 200_000
SCALES: Final = (1.0, 0.85, 0.7, 0.6, 0.5)
COMMANDS: Final = {
    "phone": "put the red cup into the box",
    "desktop": "pick up the blue ball and put it on the coffee table",
}
CHROMIUM: Final = "/usr/bin/chromium"
READY_S: Final = 120.0
WORK_S: Final = 300.0
PATIENCE_MS: Final = 180_000  # without a graphics card the robot in 3-D is drawn slowly
SETTLED_MS: Final = 6_000
_log = logging.getLogger(__name__)


def main() -> None:
    """Start a twin and a browser, and write every picture."""
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    parser = argparse.ArgumentParser(
        description="take the pictures of the dashboard for the docs",
        epilog="example: python scripts/dashboard_pictures.py --out docs/pictures --views robot",
    )
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"))
    parser.add_argument("--views", nargs="+", choices=VIEWS, default=VIEWS)
    parser.add_argument("--browser", default=CHROMIUM, help="a Chromium (default: %(default)s)")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="vla-") as folder, sync_playwright() as playwright:
        stack = ProcessStack(Path(folder) / "base")
        try:
            stack.wait_until_armed()
            if not stack.wait_until(lambda: stack.document(topics.DASHBOARD_STATUS), READY_S):
                raise RobotFailed(
                    "the dashboard does not tell its address: vla-deploy logs dashboard"
                )
            browser = playwright.chromium.launch(
                executable_path=arguments.browser, args=["--no-sandbox"]
            )
            take_all(stack, browser, arguments.out, arguments.views)
            browser.close()
        finally:
            stack.close()


def take_all(stack: ProcessStack, browser: Browser, out: Path, views: tuple[str, ...]) -> None:
    """Give a command, and write a picture of each view, at each size.

    Raises:
        RobotFailed: the robot does not come to the end of its command.
    """
    url = stack.document(topics.DASHBOARD_STATUS)["url"]
    for device, size in SIZES.items():
        if not stack.wait_until(
            lambda: stack.document(topics.EXECUTOR_STATUS)["state"] == "idle", WORK_S
        ):
            raise RobotFailed(f"the robot still works after {WORK_S:g} s: vla-deploy status")
        dark = THEMES[device] == "dark"
        context = browser.new_context(viewport=size, color_scheme="dark" if dark else "light")
        page = context.new_page()
        page.goto(login_url(stack.run_dir, url))
        page.get_by_label("Safety state", exact=True).wait_for()
        page.goto(f"{url}/#/command")
        page.get_by_label("Command in words").fill(COMMANDS[device])
        page.get_by_label("Command in words").press("Enter")
        for view in views:
            write(take(page, view), out / f"{view}-{device}.png")
        context.close()


def take(page: Page, view: str) -> bytes:
    """Return a PNG of a view once its values have come."""
    page.evaluate("view => { location.hash = `#/${view}` }", view)
    page.get_by_role("heading", level=1).wait_for()
    if view == "profile":
        page.locator(".profile").nth(1).click()
    page.evaluate("() => { scrollTo(0, 0); document.activeElement.blur(); }")
    page.wait_for_timeout(SETTLED_MS)
    return page.screenshot(timeout=PATIENCE_MS)


def write(png: bytes, path: Path) -> None:
    """Write a picture, smaller where it would be too large for a repository."""
    whole = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
    assert whole is not None
    for scale in SCALES:
        image = cv2.resize(whole, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        _, encoded = cv2.imencode(".png", image, (cv2.IMWRITE_PNG_COMPRESSION, 9))
        if encoded.nbytes < MOST_BYTES:
            break
    path.write_bytes(encoded.tobytes())
    _log.info("%s: %d kB at %.0f %%", path, encoded.nbytes / 1000, 100 * scale)


if __name__ == "__main__":
    main()
