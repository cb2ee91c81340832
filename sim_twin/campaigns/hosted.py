"""Run the robot on its twin for a campaign: with a recorded board, and with a hog in perception.

Neither is an option of `vla-deploy run`: a robot that is in use must not be told false readings.
"""

import argparse
import logging
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from drivers.twin_page import TwinPace
from sim_twin.campaigns.pressing import hog
from vla_deploy.supervisor.runs.options import RunOptions
from vla_deploy.supervisor.supervisor import Supervisor
from vla_deploy.supervisor.table import TABLE, ProcessSpec

BURDENED = "perception"


def table_with_hog(wish: Path) -> tuple[ProcessSpec, ...]:
    """Return the process table in which one process has the hog's children."""
    words = (str(Path(hog.__file__).resolve()), str(wish))
    return tuple(
        replace(spec, command=(*words, *spec.command)) if spec.name == BURDENED else spec
        for spec in TABLE
    )


def main(argv: Sequence[str] | None = None) -> None:
    """Run until SIGTERM."""
    parser = argparse.ArgumentParser(prog="hosted", description=__doc__)
    parser.add_argument("--runtime-base", type=Path, required=True)
    parser.add_argument("--profile", required=True)
    parser.add_argument("--probe-root", type=Path, default=Path("/"))
    parser.add_argument("--wish", type=Path, help="what the hog uses; none without")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args(argv)
    logging.basicConfig(stream=sys.stdout, level=logging.INFO, format="%(message)s")
    options = RunOptions(
        profile=given.profile,
        twin=True,
        seed=given.seed,
        runtime_base=given.runtime_base,
        arm=True,
        probe_root=given.probe_root,
        pace=TwinPace.WALL,  # lateness and budgets are judged by the wall clock
    )
    table = TABLE if given.wish is None else table_with_hog(given.wish)
    with Supervisor(options, table) as supervisor:
        supervisor.start()
        sys.stdout.write("ready;\n")  # as `vla-deploy run` says it
        sys.stdout.flush()
        supervisor.run_until_stopped()


if __name__ == "__main__":
    main()
