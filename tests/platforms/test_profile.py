import pytest

from platforms import ProfileError, load_profile
from platforms.board import MODULES
from platforms.ladder import LadderAction, LadderStep
from platforms.profile import PROFILES, profile_from, profile_names
from platforms.profile_schema import NODES, PROCESSES
from platforms.profile_source import read_source

BUDGETS = {name: budget for name, budget in load_profile("base").budgets.items() if name != "twin"}
MEMORY_MB = sum(budget.memory_mb for budget in BUDGETS.values())
CORES = sum(budget.cpu_ratio for budget in BUDGETS.values())
LADDER_PROCESSES = ", ".join(name for name in NODES if name != "control")

TEN_FAULTS = """
inherits = "base"
control_rate_hz = "fast"
bus_watchdog_s = 3.0
camera_rate_hz = true
perception_rate_hz = 0
realtime_priority = 10.5
colour = "blue"

[budgets]
control = { memory_mb = -1 }
planner = 7
total = { power_w = 0 }

[models.detector]
tiers = []
providers = ["CPUExecutionProvider"]
precision = "fp16"
threads = 1
cpu_fallback = 1
memory_arena = true
"""


@pytest.fixture
def write(tmp_path):
    def write(text: str, name: str = "mine"):
        path = tmp_path / f"{name}.toml"
        path.write_text(text)
        return path

    return write


@pytest.fixture
def faults_of(write):
    def faults_of(text: str) -> tuple[str, ...]:
        path = write(text)
        with pytest.raises(ProfileError) as caught:
            load_profile(path)
        assert all(fault.startswith(f"{path}: ") for fault in caught.value.faults)
        return tuple(fault.removeprefix(f"{path}: ") for fault in caught.value.faults)

    return faults_of


def mine(text: str) -> str:
    return f'inherits = "base"\n{text}'


@pytest.mark.parametrize("name", profile_names())
def test_every_shipped_profile_loads_under_its_name(name):
    assert load_profile(name).name == name


def test_a_profile_is_loaded_by_path(write):
    path = write(mine("control_rate_hz = 100"))
    profile = load_profile(str(path))
    assert (profile.name, profile.control_rate_hz) == ("mine", 100)
    assert profile.budgets["control"].memory_mb == 250


def test_ten_faults_are_reported_as_ten(faults_of):
    faults = faults_of(TEN_FAULTS)
    assert sorted(faults) == sorted(
        [
            "colour: unknown key, expected control_rate_hz, bus_watchdog_s, can_heartbeat_s, "
            "camera_rate_hz, perception_rate_hz, executor_rate_hz, realtime_priority, "
            "realtime_required, memory_lock, power_mode, ros",
            "control_rate_hz: expected a number from 50 to 1000 Hz, got 'fast'",
            "bus_watchdog_s: expected a number from 0.02 to 2.54 s, got 3.0",
            "camera_rate_hz: expected a number from 1 to 60 Hz, got True",
            "perception_rate_hz: expected a number from 0.5 to 60 Hz, got 0",
            "realtime_priority: expected an integer from 0 to 80, got 10.5",
            "budgets.control.memory_mb: expected a number from 1 to 262144 MB, got -1",
            "budgets.planner: expected a table with memory_mb, cpu_ratio, got 7",
            "budgets.total.power_w: expected a number from 1 to 1000 W, got 0",
            "models.detector.tiers: expected a list, each a text, none twice, not empty, got []",
            "models.detector.cpu_fallback: expected true or false, got 1",
        ]
    )


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (
            "control_rate_hz = 100\nbus_watchdog_s = 0.025",
            "bus_watchdog_s: expected at least 3 control periods (0.03 s), got 0.025",
        ),
        (
            "camera_rate_hz = 5\nperception_rate_hz = 10",
            "perception_rate_hz: expected at most camera_rate_hz (5 Hz), got 10",
        ),
        (
            "speech.end_silence_s = 1.0\nspeech.unfinished_silence_s = 0.5",
            "speech.unfinished_silence_s: expected at least end_silence_s (1 s), got 0.5",
        ),
        (
            "board.cpu_count = 4\nprocesses.control.affinity = [3, 4]",
            "processes.control.affinity: expected CPUs of the board, 0 to 3, got [4]",
        ),
        (
            "budgets.total.memory_mb = 500",
            f"budgets.total.memory_mb: expected at least the {MEMORY_MB:g} MB of all processes, "
            "got 500",
        ),
        (
            "budgets.total.cpu_ratio = 1.5",
            f"budgets.total.cpu_ratio: expected at least the {CORES:g} cores of all processes, "
            "got 1.5",
        ),
        (
            "board.memory_mb = 2048\nbudgets.total.memory_mb = 2500",
            "budgets.total.memory_mb: expected at most the 2048 that the board has, got 2500",
        ),
    ],
)
def test_a_contradiction_is_one_fault(faults_of, text, fault):
    assert faults_of(mine(text)) == (fault,)


def step(action: str, **values: object) -> str:
    lines = [f"{key} = {value if key == 'ratio' else repr(value)}" for key, value in values.items()]
    return "\n".join(["[[ladder]]", f"action = '{action}'", *lines, ""])


@pytest.mark.parametrize(
    ("steps", "fault"),
    [
        (
            step("suspend", process="planner") + step("slow", process="perception", ratio=0.5),
            "ladder[1].action: expected the order slow -> smaller_model -> suspend -> restart -> "
            "protective_stop, got slow after suspend",
        ),
        (
            step("slow", process="control", ratio=0.5),
            f"ladder[0].process: expected one of {LADDER_PROCESSES}, got 'control'",
        ),
        (
            step("restart"),
            f"ladder[0].process: expected one of {LADDER_PROCESSES}, got 'nothing'",
        ),
        (
            step("protective_stop", process="planner"),
            "ladder[0].process: expected nothing, a stop concerns the robot, got 'planner'",
        ),
        (
            step("slow", process="planner"),
            "ladder[0].ratio: expected a ratio below 1, got nothing",
        ),
        (
            step("suspend", process="planner", ratio=0.5),
            "ladder[0].ratio: expected nothing, only slow has a ratio, got 0.5",
        ),
        (
            step("smaller_model", process="perception"),
            "ladder[0].action: expected a smaller model of perception to go to, got none: "
            "models.detector.tiers has detector",
        ),
        (
            2 * step("smaller_model", process="speech")
            + '[models.speech_to_text]\ntiers = ["large", "small"]\n',
            "ladder[1].action: expected a smaller model of speech to go to, got none: "
            "models.speech_to_text.tiers has large, small",
        ),
        (
            step("smaller_model", process="recorder"),
            "ladder[0].action: expected a smaller model of recorder to go to, got none: no models",
        ),
    ],
)
def test_a_bad_ladder_is_one_fault(faults_of, steps, fault):
    assert faults_of(mine(steps)) == (fault,)


def test_a_ladder_replaces_the_inherited_one(write):
    profile = load_profile(write(mine(step("suspend", process="planner"))))
    assert profile.ladder == (LadderStep(action=LadderAction.SUSPEND, process="planner"),)


def test_a_watchdog_of_exactly_three_control_periods_is_allowed(write):
    path = write(mine("control_rate_hz = 100\nbus_watchdog_s = 0.03"))
    assert load_profile(path).bus_watchdog_s == 0.03


def test_an_unknown_process_and_missing_tables_are_faults(faults_of):
    assert faults_of(mine("[budgets.radio]\nmemory_mb = 1\ncpu_ratio = 1")) == (
        f"budgets.radio: unknown, expected one of {', '.join(PROCESSES)}",
    )
    missing = faults_of("control_rate_hz = 250")
    assert "budgets: expected a table for each of supervisor, control" in "\n".join(missing)
    assert "ladder: expected a list of steps with action, got nothing" in missing


def test_an_unknown_name_lists_the_known_ones():
    with pytest.raises(ProfileError, match=r"no profile 'deskop': choose .*desktop"):
        load_profile("deskop")


def test_broken_toml_and_missing_files_name_the_path(faults_of, tmp_path):
    assert "line 1" in faults_of("control_rate_hz = = 3")[0]
    with pytest.raises(ProfileError, match=r"gone\.toml: expected a TOML file"):
        load_profile(tmp_path / "gone.toml")


def test_toml_that_is_nested_without_end_is_a_fault(faults_of):
    (fault,) = faults_of(f"depth = {'[' * 5000}")
    assert "expected a TOML file: maximum recursion depth" in fault


def test_every_shipped_profile_file_is_named(tmp_path):
    assert {f"{name}.toml" for name in profile_names()} == {
        path.name for path in PROFILES.iterdir() if path.suffix == ".toml"
    }


def test_what_is_inherited_melts_together_and_says_where_it_stands(write, tmp_path):
    write('inherits = "base"\nboard.memory_mb = 5000\nprocesses.planner.nice = 4', "middle")
    source = read_source(write('inherits = "middle"\nprocesses.planner.threads = 3'))
    planner = profile_from(source).processes["planner"]
    assert (planner.nice, planner.threads, planner.affinity) == (4, 3, ())
    assert source.parents == ("middle", "base")
    assert source.file_of("processes.planner.threads") == tmp_path / "mine.toml"
    assert source.file_of("board.memory_mb") == tmp_path / "middle.toml"
    assert source.file_of("processes.planner.affinity") == PROFILES / "base.toml"


def test_a_fault_names_the_file_that_it_stands_in(write, tmp_path):
    write('inherits = "base"\nboard.memory_mb = 0', "middle")
    with pytest.raises(ProfileError) as caught:
        load_profile(write('inherits = "middle"\nprocesses.planner.nice = 30'))
    assert sorted(caught.value.faults) == [
        f"{tmp_path / 'middle.toml'}: board.memory_mb: "
        "expected a number from 1 to 262144 MB, got 0",
        f"{tmp_path / 'mine.toml'}: processes.planner.nice: "
        "expected an integer from -20 to 19, got 30",
    ]


def test_inheritance_in_a_circle_is_shown(write, tmp_path):
    write('inherits = "second"', "first")
    write('inherits = "first"', "second")
    with pytest.raises(ProfileError, match="inherits: expected an end, got mine -> first -> seco"):
        load_profile(write('inherits = "first"'))


@pytest.mark.parametrize("parent", ['"bse"', "7", '"../base"'])
def test_an_unknown_parent_is_a_fault(write, parent):
    with pytest.raises(ProfileError, match=r"mine\.toml: inherits: expected "):
        load_profile(write(f"inherits = {parent}"))


def test_every_board_that_is_known_has_its_profile():
    modules = MODULES.values()
    wanted = {module.profile for module in modules} | {
        module.super_profile for module in modules if module.super_profile
    }
    assert wanted <= set(profile_names())
