"""Give every benchmark the same command line: a help text with an example, and `--json`."""

import argparse
import json
from collections.abc import Callable
from typing import Any


def parser(name: str, doc: str | None) -> argparse.ArgumentParser:
    """Return the arguments that all benchmarks have; `doc` is the module's own."""
    # Those with an underscore are parts of others, or stand beside what `vla-deploy bench` lists.
    command = f"python -m benchmarks.{name}" if "_" in name else f"vla-deploy bench {name}"
    made = argparse.ArgumentParser(
        prog=f"bench {name}",
        description=doc,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog=f"example:\n  {command} --json",
    )
    made.add_argument("--json", action="store_true", help="print the figures as JSON")
    return made


def rows(report: dict[str, Any]) -> str:
    """Return one line per figure."""
    width = max(map(len, report))
    return "\n".join(f"{name:{width}} {_short(value)}" for name, value in report.items())


def show(
    report: dict[str, Any], *, as_json: bool, text: Callable[[dict[str, Any]], str] = rows
) -> None:
    """Print a report."""
    print(json.dumps(report, indent=2) if as_json else text(report))


def _short(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
