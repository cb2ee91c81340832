"""Use as much memory and CPU as a file says: `hog.py RUN_DIR NAME WISH`, a process of the table."""

import json
import logging
import os
import signal
import sys
import time
from pathlib import Path

run_dir, name, wish = Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3])
stopping: list[int] = []
signal.signal(signal.SIGTERM, lambda number, _: stopping.append(number))
(run_dir / "ready").mkdir(exist_ok=True)
(run_dir / "ready" / name).write_text(str(os.getpid()))
kept = bytearray()
while not stopping:
    wanted = json.loads(wish.read_text()).get(name, {})
    pages = wanted.get("memory_mb", 0) * 1_000_000 // 4096
    if len(kept) != pages * 4096:
        del kept  # both together would be more than was wished for
        kept = bytearray(os.urandom(4096)) * pages
    for line in range(wanted.get("lines", 0)):
        logging.warning("line %d of a talkative process", line)
    busy_until_ns = time.monotonic_ns() + (20_000_000 if wanted.get("busy") else 0)
    while time.monotonic_ns() < busy_until_ns:
        pass
    if not wanted.get("busy"):
        time.sleep(0.05)
