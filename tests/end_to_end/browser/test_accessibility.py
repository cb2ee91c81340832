"""Use every view by keyboard, and let axe-core judge it in both themes."""

from pathlib import Path
from typing import Any, Final

import pytest
from playwright.sync_api import Page, expect

pytestmark = [pytest.mark.gl, pytest.mark.stack, pytest.mark.timeout(300)]

AXE: Final = Path(__file__).parent.joinpath("vendor", "axe.js").read_text(encoding="utf-8")
VIEWS: Final = ("now", "robot", "command", "budgets", "events", "profile")
GRAVE: Final = ("serious", "critical")
MOST_TABS: Final = 60


def see(page: Page, view: str) -> None:
    page.evaluate("view => { location.hash = `#/${view}` }", view)
    expect(page.get_by_role("heading", level=1)).to_have_text(view.capitalize())
    expect(page.locator("main [aria-busy=true]")).to_have_count(0)


def judged(page: Page, *rules: str) -> list[dict[str, Any]]:
    """Return what axe-core objects to by these rules, all without."""
    page.evaluate(f"() => {{ if (!window.axe) {{ {AXE} }} }}")
    told = page.evaluate(
        "rules => axe.run(document, { resultTypes: ['violations'], "
        "...(rules.length ? { runOnly: rules } : {}) })",
        rules,
    )
    return [
        {"rule": one["id"], "where": [node["html"][:160] for node in one["nodes"]][:3]}
        for one in told["violations"]
        if one["impact"] in GRAVE
    ]


@pytest.mark.parametrize("view", VIEWS)
def test_axe_has_no_grave_objection(page: Page, view: str) -> None:
    page.emulate_media(color_scheme="light")
    see(page, view)
    assert judged(page) == []
    page.emulate_media(color_scheme="dark")  # changes colours, and nothing else
    assert judged(page, "color-contrast") == []


def test_a_change_of_theme_reaches_every_word_at_once(page: Page) -> None:
    see(page, "now")
    before = None
    for theme in ("light", "dark") * 4:
        page.emulate_media(color_scheme=theme)
        colour = page.evaluate(
            "() => getComputedStyle(document.querySelector('.brand-name')).color"
        )
        assert colour != before
        before = colour


def focused(page: Page) -> str:
    """Return the accessible name of what has the focus, nearly as a screen reader would."""
    name = page.evaluate(
        "() => { const one = document.activeElement;"
        " return one.getAttribute('aria-label') ?? one.innerText ?? one.tagName; }"
    )
    return str(name).strip().split("\n")[0]


def tab_to(page: Page, name: str) -> list[str]:
    """Press Tab until something of that name has the focus; return what was passed."""
    passed: list[str] = []
    for _ in range(MOST_TABS):
        page.keyboard.press("Tab")
        passed.append(focused(page))
        if passed[-1] == name:
            return passed
    raise AssertionError(f"{name!r} is not reached by Tab, only {passed}")


def test_every_view_is_reached_and_used_by_keyboard_alone(page: Page) -> None:
    see(page, "now")
    page.evaluate("() => document.activeElement.blur()")
    passed = tab_to(page, "Robot")
    assert "STOP" in (one.upper() for one in passed)  # always in reach, and early
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", level=1)).to_have_text("Robot")
    tab_to(page, "Follow")
    page.keyboard.press("Space")
    expect(page.get_by_role("button", name="Follow")).to_have_attribute("aria-pressed", "true")
    tab_to(page, "Map of the floor")
    page.keyboard.press("ArrowLeft")  # whoever looks elsewhere no longer follows
    expect(page.get_by_role("button", name="Follow")).to_have_attribute("aria-pressed", "false")
