"""Measure how much memory a model takes, in a process that has held no other."""

import dataclasses
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from drivers.clock import MonotonicClock
from platforms import ModelChoice
from vla_deploy.inference.errors import RunFailed
from vla_deploy.inference.manifest import Variant
from vla_deploy.inference.manifest_file import read_manifest
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.inference.session import ModelSession, open_session
from vla_deploy.inference.store import StoredModel


def memory_mb(session: ModelSession, choice: ModelChoice, shelf: ModelShelf) -> float:
    """Return by how much a fresh process grows that opens the same file in the same way.

    Here, a second session would use again what the first one has given back.

    Raises:
        RunFailed: that process failed.
    """
    told = {
        "folder": str(session.model.folder),
        "variant": session.variant,
        "engines": str(shelf.engines),
        "choice": dataclasses.asdict(choice),
    }
    command = [sys.executable, "-m", __name__, json.dumps(told)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        last = done.stderr.strip().rpartition("\n")[2]
        raise RunFailed(f"{session.model.manifest.name}: no memory was measured: {last}")
    return float(done.stdout)


def main() -> None:
    """Open the model that the argument describes, and print by how much this process grew."""
    told = json.loads(sys.argv[1])
    folder = Path(told["folder"])
    values: dict[str, Any] = told["choice"]
    lists = {key: tuple(values[key]) for key in ("tiers", "providers")}
    choice = ModelChoice(**{**values, **lists})
    model = StoredModel(manifest=read_manifest(folder), folder=folder)
    session = open_session(
        model.only(Variant(told["variant"])),
        choice,
        engines=Path(told["engines"]),
        clock=MonotonicClock(),
    )
    sys.stdout.write(f"{session.stats().memory_mb:.3f}\n")


if __name__ == "__main__":
    main()
