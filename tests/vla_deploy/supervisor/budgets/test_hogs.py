"""Real processes that use too much, and boards that get hot or lose power, by real files."""

import json
import os
import subprocess
import time
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from vla_deploy.supervisor.runs.options import RunOptions
from vla_deploy.supervisor.supervisor import Supervisor
from vla_deploy.supervisor.table import ProcessSpec

pytestmark = [pytest.mark.stack, pytest.mark.timeout(120)]

HOG = str(Path(__file__).with_name("hog.py"))
BOARD = Path(__file__).parents[3] / "platforms/trees/orin_nano_8gb_super.toml"
PROFILE = """
inherits = "desktop"
ladder = [
  { action = "slow", process = "perception", ratio = 0.5 },
  { action = "smaller_model", process = "perception" },
  { action = "suspend", process = "planner" },
  { action = "restart", process = "perception" },
  { action = "protective_stop" },
]
ladder_timing = { rise_s = 1.0, fall_s = 1.0, release_ratio = 0.85 }
[models.detector]
tiers = ["detector", "smaller"]
[budgets]
perception = { memory_mb = 100, cpu_ratio = 0.15 }
planner = { memory_mb = 100, cpu_ratio = 0.15 }
[budgets.total]
temperature_c = 85.0
disk_free_mb = 1
"""


class Stage:
    """Run hogs under a supervisor, and read its `budget` cell."""

    def __init__(self, directory: Path, *, recorded: bool = True) -> None:
        self.base = directory / "base"
        self.profile = directory / "quick.toml"
        self.profile.write_text(PROFILE)
        self.wish_path = directory / "wish.json"
        self.board = directory / "board" if recorded else Path("/")
        self.wish()
        table = tuple(self._row(name) for name in ("perception", "planner"))
        options = RunOptions(
            profile=str(self.profile), twin=True, runtime_base=self.base, probe_root=self.board
        )
        if recorded:
            self.make_board()
        self.supervisor = Supervisor(options, table)

    def _row(self, name: str) -> ProcessSpec:
        def wanted(context) -> str:
            return context.suspended.get(name, "")

        return ProcessSpec(
            name=name,
            command=(HOG, "{run_dir}", name, str(self.wish_path)),
            when=wanted,
            ready_files=(f"ready/{name}",),
        )

    def wish(self, **processes: dict[str, int]) -> None:
        fresh = self.wish_path.with_suffix(".new")
        fresh.write_text(json.dumps(processes))
        fresh.replace(self.wish_path)

    def make_board(self) -> None:
        """Lay out a recorded board, with the trip point at which it goes off."""
        zone = "/sys/class/thermal/thermal_zone0"
        critical = {f"{zone}/trip_point_1_type": "critical", f"{zone}/trip_point_1_temp": "104500"}
        for name, content in {**tomllib.loads(BOARD.read_text())["files"], **critical}.items():
            path = self.board / name.lstrip("/")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content)

    def heat(self, degrees: float) -> None:
        for zone in (self.board / "sys/class/thermal").glob("thermal_zone*/temp"):
            zone.write_text(f"{round(1000 * degrees)}\n")

    def until(self, condition: Callable[[dict], bool], timeout_s: float = 30.0) -> dict:
        """Step the supervisor until its budgets are as wanted."""
        cell = self.supervisor.space.cell_reader("budget")
        end_ns = time.monotonic_ns() + round(timeout_s * 1e9)
        while True:
            self.supervisor.step()
            sample = cell.latest()
            budget = sample.document() if sample is not None else {}
            if budget and condition(budget):
                return budget
            assert time.monotonic_ns() < end_ns, budget
            time.sleep(0.05)

    def pid(self, name: str) -> int | None:
        pid: int | None = self.row(name)["pid"]
        return pid

    def row(self, name: str) -> dict:
        sample = self.supervisor.space.cell_reader("process_table").latest()
        assert sample is not None
        rows = sample.document()["processes"]
        return next(row for row in rows if row["name"] == name)


@pytest.fixture
def stage(tmp_path: Path) -> Iterator[Stage]:
    stage = Stage(tmp_path)
    with stage.supervisor:
        stage.supervisor.start()
        stage.until(lambda budget: bool(budget["rows"]))
        yield stage


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """Give the run a disk of a few megabytes."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = (
        os.geteuid() == 0
        and not subprocess.run(
            ["mount", "-t", "tmpfs", "-o", "size=6m", "tmpfs", str(disk)], check=False
        ).returncode
    )
    if not mounted:
        pytest.skip("only root may mount a small disk")
    yield disk
    subprocess.run(["umount", "--lazy", str(disk)], check=True)


def steps(budget: dict, *, taken: bool) -> list[str]:
    return [row["action"] for row in budget["ladder"]["history"] if row["taken"] is taken]


def calm(budget: dict) -> bool:
    return budget["ladder"]["step"] == 0 and bool(budget["ladder"]["history"])


def test_a_memory_hog_takes_its_steps_in_order_is_started_anew_and_is_forgiven(stage: Stage):
    before, bystander = stage.pid("perception"), stage.pid("planner")
    stage.wish(perception={"memory_mb": 150})
    budget = stage.until(lambda one: one["ladder"]["step"] == 3)
    assert steps(budget, taken=True) == ["slow", "smaller_model", "restart"]
    directives = stage.supervisor.space.cell_reader("resource_directives").latest().document()
    assert directives["rate_ratio"] == {"perception": 0.5}
    assert directives["model_tier"] == {"perception": 1}
    stage.wish()
    budget = stage.until(calm)
    assert steps(budget, taken=False) == ["restart", "smaller_model", "slow"]
    assert stage.pid("perception") != before
    assert stage.pid("planner") == bystander


def test_a_cpu_hog_is_held_back_then_suspended_and_comes_back(stage: Stage):
    pid = stage.pid("planner")
    assert pid is not None
    stage.wish(planner={"busy": 1})
    budget = stage.until(lambda one: one["ladder"]["step"] == 1)
    assert steps(budget, taken=True) == ["suspend"]
    stage.until(lambda _: stage.row("planner")["state"] == "off")
    assert stage.row("planner")["reason"] == "suspended by the budgets"
    assert stage.pid("planner") is None
    stage.wish()
    stage.until(calm)
    stage.until(lambda _: stage.row("planner")["state"] == "ready")
    assert stage.pid("planner") != pid
    assert stage.row("planner")["restarts"] == 0


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may lower nice again")
def test_a_cpu_hog_without_a_step_to_take_runs_with_a_low_claim_until_it_is_calm(stage: Stage):
    pid = stage.pid("perception")
    assert pid is not None
    nice, cores = os.getpriority(os.PRIO_PROCESS, pid), os.sched_getaffinity(pid)
    stage.wish(perception={"busy": 1})
    budget = stage.until(lambda one: one["ladder"]["step"] == 1)
    row = next(row for row in budget["enforced"] if row["process"] == "perception")
    if row["cpu"].startswith("cgroup"):
        pytest.skip("control groups limit the CPU here")
    stage.until(lambda _: os.getpriority(os.PRIO_PROCESS, pid) == 10)
    assert len(os.sched_getaffinity(pid)) == 1
    stage.wish()
    stage.until(calm)
    assert stage.pid("perception") == pid
    assert os.getpriority(os.PRIO_PROCESS, pid) == nice
    assert os.sched_getaffinity(pid) == cores


def test_a_thermal_ramp_goes_down_to_the_protective_stop_and_back(stage: Stage):
    stage.heat(90.0)
    budget = stage.until(lambda one: one["stop"])
    assert steps(budget, taken=True) == ["slow", "smaller_model", "suspend", "protective_stop"]
    assert "temperature_c 90" in budget["reason"]
    stage.heat(45.0)
    budget = stage.until(calm)
    assert not budget["stop"]
    assert steps(budget, taken=False) == ["protective_stop", "suspend", "smaller_model", "slow"]


def test_critical_heat_and_a_brown_out_stop_the_robot_at_once(stage: Stage):
    stage.heat(103.0)
    budget = stage.until(lambda one: one["stop"])
    assert steps(budget, taken=True) == ["protective_stop"]
    assert "the board goes off" in budget["reason"]
    stage.heat(45.0)
    stage.until(calm)
    counter = stage.board / "sys/class/hwmon/hwmon2/oc1_event_cnt"
    counter.write_text("2\n")
    budget = stage.until(lambda one: one["stop"])
    assert "under-voltage" in budget["reason"]
    stage.until(calm)


def test_a_full_disk_is_warned_of_and_nobody_falls_over(small_disk: Path):
    stage = Stage(small_disk, recorded=False)
    with stage.supervisor:
        stage.supervisor.start()
        stage.until(lambda budget: bool(budget["rows"]))
        pids = {name: stage.pid(name) for name in ("perception", "planner")}
        stage.wish(perception={"lines": 20})
        ballast = small_disk / "ballast"
        with pytest.raises(OSError, match="No space left"):
            ballast.write_bytes(bytes(8_000_000))

        def warned(budget: dict) -> bool:
            return any(row["metric"] == "disk_free_mb" and row["over"] for row in budget["rows"])

        budget = stage.until(warned)
        assert budget["ladder"]["step"] == 0
        ballast.unlink()
        stage.until(lambda budget: not warned(budget))
        assert {name: stage.pid(name) for name in pids} == pids
