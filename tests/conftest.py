import errno
import gc
import os
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from xdist.remote import Producer
from xdist.scheduler import LoadScopeScheduling

# How long an example takes tells how busy the machine is, not whether the code is right.
settings.register_profile(
    "any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("any machine")

# Whichever test loads onnxruntime first: it phones home otherwise.
os.environ["ORT_DISABLE_TELEMETRY"] = "1"

BROWSER = "browser"
"""The folder whose tests share one robot and one browser."""


class FileScheduling(LoadScopeScheduling):
    """Give each file to one worker, and all files of the browser: they share one robot."""

    def _split_scope(self, nodeid: str) -> str:
        file = nodeid.partition("::")[0]
        return BROWSER if f"/{BROWSER}/" in file else file


def pytest_xdist_make_scheduler(config: pytest.Config, log: Producer) -> LoadScopeScheduling | None:
    return FileScheduling(config, log) if config.getvalue("dist") == "loadfile" else None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Refuse a mark that comes from elsewhere: `scripts/check` would run such a test nowhere."""
    for path in sorted({item.path for item in items if item.get_closest_marker("stack")}):
        if "mark.stack" not in path.read_text(encoding="utf-8"):
            raise pytest.UsageError(f"{path}: tests marked `stack`; write pytest.mark.stack here")


@pytest.hookimpl(trylast=True)
def pytest_collection_finish() -> None:
    """Keep ten thousand collected tests out of every later collection of garbage."""
    gc.collect()
    gc.freeze()


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
