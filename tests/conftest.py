import errno
import os
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from sim_twin.stillness import HELD_UP_S, STOLEN_RATIO, StillnessWatch, StolenTime

# How long an example takes tells how busy the machine is, not whether the code is right.
settings.register_profile(
    "any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("any machine")

# Whichever test loads onnxruntime first: it phones home otherwise.
os.environ["ORT_DISABLE_TELEMETRY"] = "1"

WATCH = pytest.StashKey[StillnessWatch]()
STOLEN = pytest.StashKey[StolenTime]()
JUDGED = pytest.StashKey[list[str]]()
MOST_AGAIN = 4
"""A busy host takes a core away for 0.1 s once a minute, which is as long as such a test runs."""
STANDS = ("orphan", "hazard", "joint range", "joint speed", "workspace", "push", "fall ", "tilt")
"""A failure that tells of one of these is not explained by what the host did to this computer."""


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Try a failed test of the wall clock again, if what the host did to the cores explains it.

    A test that judges that by itself, as campaigns do, is marked `stack(again=False)`.
    """

    def is_void(error: BaseException | None) -> bool:
        if error is None:  # it is asked after a success, too
            return False
        held_up_s, stolen = config.stash[WATCH].worst_s(), config.stash[STOLEN].ratio()
        is_explained = held_up_s > HELD_UP_S or stolen > STOLEN_RATIO
        void = is_explained and not any(word in str(error) for word in STANDS)
        verdict = "void, again" if void else "it stands"
        found = f"stood still for {held_up_s:.3f} s, {stolen:.0%} of the cores stolen"
        told = f"{verdict}: {found}: {str(error)[:160]}"
        judged.append(told.replace("\n", " "))
        terminal.line(judged[-1])  # at once, should the run be cut off
        return void

    terminal = config.get_terminal_writer()
    judged = config.stash.setdefault(JUDGED, [])
    for item in items:
        stack = item.get_closest_marker("stack")
        if stack and stack.kwargs.get("again", True):
            item.add_marker(pytest.mark.flaky(reruns=MOST_AGAIN, condition=is_void))
    _stack_is_named({item.path for item in items if item.get_closest_marker("stack")})


def _stack_is_named(paths: set[Path]) -> None:
    """Refuse a mark that comes from elsewhere: `scripts/check` would run such a test nowhere."""
    for path in sorted(paths):
        if "mark.stack" not in path.read_text(encoding="utf-8"):
            raise pytest.UsageError(f"{path}: tests marked `stack`; write pytest.mark.stack here")


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    if not item.get_closest_marker("stack"):
        return
    if WATCH not in item.config.stash:
        item.config.stash[WATCH] = StillnessWatch()
    item.config.stash[WATCH].worst_s()
    item.config.stash[STOLEN] = StolenTime()


def pytest_unconfigure(config: pytest.Config) -> None:
    """Tell at the very end, where a log that was cut still has it, why a failure stands or not."""
    for line in config.stash.get(JUDGED, []):
        config.get_terminal_writer().line(line)
    if WATCH in config.stash:
        config.stash[WATCH].close()


TREES = Path(__file__).parent / "platforms" / "trees"


@pytest.fixture
def failing_reads(monkeypatch: pytest.MonkeyPatch) -> dict[Path, int]:
    """Reading a file named here fails with its errno, as no file on a disk would."""
    failures: dict[Path, int] = {}
    pread = os.pread

    def pread_or_fail(handle: int, count: int, offset: int) -> bytes:
        number = failures.get(Path(f"/proc/self/fd/{handle}").readlink())
        if number is not None:
            raise OSError(number, os.strerror(number))
        return pread(handle, count, offset)

    monkeypatch.setattr(os, "pread", pread_or_fail)
    return failures


@pytest.fixture
def board_tree(tmp_path: Path, failing_reads: dict[Path, int]) -> Callable[[str], Path]:
    """Lay out the files of a board described in tests/platforms/trees; return their root."""

    def lay_out(name: str) -> Path:
        description = tomllib.loads((TREES / f"{name}.toml").read_text())
        root = tmp_path / name
        for path, text in description["files"].items():
            file = root / path.lstrip("/")
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        for path in description.get("asleep", ()):
            failing_reads[root / path.lstrip("/")] = errno.EAGAIN
        return root

    return lay_out
