"""Look at the files of the page, without a browser."""

import re
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import pytest

STATIC = Path(str(files("vla_deploy.dashboard") / "static"))
OWN = sorted(path for path in STATIC.rglob("*.*") if "vendor" not in path.parts)
IMPORTED = re.compile(r"""^(?:import|export)\b[^;]*?["'](\.[^"']+)["'];""", re.MULTILINE)
LOADED_LATER = re.compile(r"""import\(["'](\.[^"']+)["']\)""")


def imports(module: Path) -> Iterator[Path]:
    for name in IMPORTED.findall(module.read_text(encoding="utf-8")):
        yield (module.parent / name).resolve()


def reached(*first: Path) -> set[Path]:
    known: set[Path] = set()
    waiting = list(first)
    while waiting:
        module = waiting.pop()
        if module not in known:
            known.add(module)
            waiting.extend(imports(module))
    return known


@pytest.fixture(scope="module")
def index() -> str:
    return (STATIC / "index.html").read_text(encoding="utf-8")


def test_every_file_that_the_page_names_is_there(index: str) -> None:
    for name in re.findall(r'(?:href|src)="static/([^"]+)"', index):
        assert (STATIC / name).is_file(), name
    for module in STATIC.rglob("*.js"):
        later = LOADED_LATER.findall(module.read_text(encoding="utf-8"))
        for target in (*imports(module), *((module.parent / one).resolve() for one in later)):
            assert target.is_file(), f"{module.relative_to(STATIC)} imports {target}"


def test_what_the_first_view_needs_is_asked_for_at_once(index: str) -> None:
    preloaded = {
        STATIC / name for name in re.findall(r'modulepreload" href="static/([^"]+)', index)
    }
    assert preloaded == reached(STATIC / "main.js", STATIC / "views" / "now.js")


def test_the_stop_button_depends_on_nothing_but_its_own_logic() -> None:
    assert reached(STATIC / "stop.js") == {STATIC / "stop.js", STATIC / "stop_logic.js"}


def test_nothing_is_written_inline_that_the_policy_forbids(index: str) -> None:
    assert not re.search(r"<script(?![^>]*\bsrc=)", index)
    assert not re.search(r"<style|\sstyle=|\son\w+=", index)


@pytest.mark.parametrize("path", OWN, ids=lambda path: str(path.relative_to(STATIC)))
def test_no_file_asks_another_host_or_writes_markup_from_text(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert not re.search(r"(?:https?:|wss?:)?//[a-z0-9-]+\.[a-z]", text.replace("www.w3.org", ""))
    assert not re.search(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(", text)


def test_every_library_has_its_licence_beside_it() -> None:
    told = (STATIC / "vendor" / "README.md").read_text(encoding="utf-8")
    for library in (STATIC / "vendor").rglob("*.js"):
        assert f"`{library.relative_to(STATIC / 'vendor')}`" in told, library
    assert list((STATIC / "vendor").glob("*.LICENSE"))
