"""Behave as a process of the table might: `child.py RUN_DIR NAME EVENTS BEHAVIOUR`."""

import os
import signal
import subprocess
import sys
from pathlib import Path

run_dir, name, events, behaviour = Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3]), sys.argv[4]


def tell(what: str) -> None:
    with events.open("a") as file:
        file.write(f"{name} {what} {os.getpid()}\n")


def announce() -> None:
    (run_dir / "ready").mkdir(exist_ok=True)
    (run_dir / "ready" / name).write_text(str(os.getpid()))


signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM, signal.SIGINT})
tell("started")
if behaviour == "refuse":
    print("robot.toml: servo 3: no such joint", file=sys.stderr)
    sys.exit(2)
if behaviour == "unwired" or (behaviour == "wired-later" and not (run_dir / "wired").exists()):
    (run_dir / "wired").touch()
    print("servos: /dev/ttyUSB0 does not exist; plug it in", file=sys.stderr)
    sys.exit(4)
if behaviour == "crash":
    sys.exit(3)
if behaviour == "family":
    grandchild = subprocess.Popen(
        [sys.executable, "-c", "import time; time.sleep(60)"], start_new_session=True
    )
    with events.open("a") as file:
        file.write(f"grandchild started {grandchild.pid}\n")
if behaviour == "abort-deaf":
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGABRT})
if behaviour in ("base", "control"):
    from beating import beat

    beat(run_dir, behaviour, announce)
if behaviour != "never-ready":
    announce()
if behaviour == "crash-later":
    signal.sigtimedwait(set(), 0.3)
    raise KeyError("elbow")
while True:
    signal.sigwait({signal.SIGTERM, signal.SIGINT})
    tell("asked to stop")
    if behaviour == "witness":
        tell("lets go" if (run_dir / "power_off").exists() else "holds")
    if behaviour != "stubborn":
        break
tell("stopped")
