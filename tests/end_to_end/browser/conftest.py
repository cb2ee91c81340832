"""One twin with its dashboard for all tests in a browser, and pages that somebody is logged in at.

Every test goes through the doors that an operator goes through.
"""

import shutil
import tempfile
import wave
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np
import pytest
from playwright.sync_api import (
    Browser,
    BrowserContext,
    ConsoleMessage,
    Page,
    Playwright,
    Request,
    ViewportSize,
    expect,
    sync_playwright,
)

from drivers.audio.espeak import EspeakEngine
from sim_twin.harness.processes import ProcessStack, armed_processes
from vla_deploy.client.access.accounts import Accounts, AccountsFile, User, wall_s
from vla_deploy.client.access.passwords import hash_password
from vla_deploy.dashboard.access import UserRole

CHROMIUM: Final = "/usr/bin/chromium"
DESKTOP: Final = ViewportSize(width=1440, height=900)
ROLES: Final = {"anna": UserRole.ADMIN, "vera": UserRole.VIEWER}
PASSWORD: Final = "five-words-that-nobody-guesses"
SPOKEN: Final = "turn left"
MICROPHONE_HZ: Final = 48_000

PATIENCE_MS: Final = 60_000
"""The machine may be busy; what is quick is not slowed by this."""

expect.set_options(timeout=PATIENCE_MS)


@pytest.fixture(scope="package")
def stack(chromium: Browser, coarse: str) -> Iterator[ProcessStack]:
    """The real processes on a twin, armed, with a dashboard that trusts nobody unknown.

    The browser is up before: beside the robot that takes long.
    """
    with tempfile.TemporaryDirectory(prefix="vla-") as folder:  # sockets want a short path
        base = Path(folder) / "base"
        add_accounts(base)
        profile = Path(folder) / "shipped.toml"  # tests write another one beside it
        shutil.copyfile(coarse, profile)
        with armed_processes(base, "--profile", str(profile)) as stack:
            assert stack.wait_until(lambda: stack.document("dashboard_status", 3.0))
            yield stack


def add_accounts(base: Path) -> None:
    stored = hash_password(PASSWORD)

    def everybody(accounts: Accounts) -> tuple[Accounts, None]:
        for name, role in ROLES.items():
            user = User(role=role, password=stored, changed_s=wall_s())
            accounts = accounts.with_user(name, user)
        return accounts, None

    AccountsFile.of_base(base).change(everybody)


@pytest.fixture(scope="package")
def url(stack: ProcessStack) -> str:
    return str(stack.document("dashboard_status")["url"])


@pytest.fixture(scope="package")
def playwright() -> Iterator[Playwright]:
    with sync_playwright() as started:
        yield started


@pytest.fixture(scope="package")
def chromium(playwright: Playwright, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """A browser whose microphone hears somebody say a command again and again.

    It gives way to the robot's processes: an operator has a computer of his own.
    """
    folder = tmp_path_factory.mktemp("browser")
    program, heard = folder / "chromium", folder / "spoken.wav"
    program.write_text(f'#!/bin/sh\nexec nice -n 5 {CHROMIUM} "$@"\n', encoding="utf-8")
    program.chmod(0o700)
    write_spoken(heard)
    browser = playwright.chromium.launch(
        executable_path=program,
        args=[
            "--no-sandbox",
            "--use-fake-device-for-media-stream",
            "--use-fake-ui-for-media-stream",
            f"--use-file-for-fake-audio-capture={heard}",
        ],
    )
    yield browser
    browser.close()


def write_spoken(path: Path) -> None:
    """Write a command as sound, with quiet around it: it comes again when nobody listens."""
    words = EspeakEngine().synthesise(SPOKEN).at_rate(MICROPHONE_HZ).wave
    before, after = (np.zeros(round(MICROPHONE_HZ * span_s), np.float32) for span_s in (1.5, 10.0))
    sound = np.concatenate([before, 0.6 * words / np.abs(words).max(), after])
    with wave.open(str(path), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(MICROPHONE_HZ)
        file.writeframes(np.rint(32_000 * sound).astype("<i2").tobytes())


class Pages:
    """Hold one page per user: a page is loaded once, and gone about in as a person does."""

    def __init__(self, chromium: Browser, url: str) -> None:
        self.faults: list[str] = []
        self._chromium = chromium
        self._url = url
        self._open: dict[str, Page] = {}
        self._brief: list[Page] = []

    def of(self, user: str, view: str = "now") -> Page:
        if user not in self._open:
            self._open[user] = self._load(user)
        page = self._open[user]
        page.evaluate("view => { location.hash = `#/${view}` }", view)
        return page

    def fresh(self) -> Page:
        """Load a page that nobody is logged in at, until the end of the test."""
        self._brief.append(self._load())
        return self._brief[-1]

    def close_fresh(self) -> None:
        """Close them: each page that is open draws on."""
        while self._brief:
            self._brief.pop().context.close()

    def _load(self, user: str | None = None) -> Page:
        # Whatever moves without end is drawn by the processor here, at the robot's expense.
        context = self._chromium.new_context(viewport=DESKTOP, reduced_motion="reduce")
        context.set_default_timeout(PATIENCE_MS)
        page = context.new_page()
        watch(page, self._url, self.faults)
        if user is not None:
            log_in(context, self._url, user)
        page.goto(self._url, wait_until="commit")
        return page


@pytest.fixture(scope="package")
def all_pages(chromium: Browser, url: str) -> Pages:
    pages = Pages(chromium, url)
    for user in ROLES:
        expect(pages.of(user).get_by_label("Safety state", exact=True)).to_be_visible()
    return pages


@pytest.fixture
def pages(all_pages: Pages) -> Iterator[Pages]:
    """Pages by user; in the end none may have failed, or asked another host."""
    yield all_pages
    all_pages.close_fresh()
    faults, all_pages.faults[:] = list(all_pages.faults), []
    assert faults == []


def watch(page: Page, url: str, faults: list[str]) -> None:
    def said(message: ConsoleMessage) -> None:
        if message.type == "error" and "Failed to load resource" not in message.text:
            faults.append(message.text)

    def asked(request: Request) -> None:
        if not request.url.startswith(("blob:", "data:", url.rpartition(":")[0])):
            faults.append(f"asked another host: {request.url}")

    page.on("console", said)
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("request", asked)


def log_in(context: BrowserContext, url: str, user: str) -> None:
    answer = context.request.post(
        f"{url}/api/v1/login",
        data={"user": user, "password": PASSWORD},
        headers={"Origin": url},
    )
    assert answer.ok, answer.text()


@pytest.fixture
def page(pages: Pages) -> Page:
    """The page of an admin, at the view Now."""
    return pages.of("anna")


@pytest.fixture(autouse=True)
def robot(stack: ProcessStack, all_pages: Pages) -> ProcessStack:
    """The robot of the tests, armed once the pages are there, whatever the last test did.

    A browser that draws without a GPU takes the twin's servos the time to answer: the bus is lost
    then, and arming is refused for as long as its error budget remembers that.
    """
    assert stack.wait_until(lambda: _is_armed(stack)), stack.status()["control"]
    return stack


def _is_armed(stack: ProcessStack) -> bool:
    if stack.state() != "armed":
        stack.ask("reset")  # which has nothing to do where nothing is latched
        stack.ask("arm")
    return stack.state() == "armed"
