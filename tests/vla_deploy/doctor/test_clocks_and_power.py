import struct

import pytest

from vla_deploy.doctor import FindingLevel, clocks, power
from vla_deploy.doctor import computer as machine

BOOT_S = 1_763_700_000
ZONE = "/sys/class/thermal/thermal_zone0"


@pytest.mark.parametrize(
    "layout", ["<hxxi32s4s32s256shhiii16x20x", "<hxxi32s4s32s256shhqqq16x20x4x"]
)
@pytest.mark.parametrize(
    ("jump_s", "level"), [(0, FindingLevel.OK), (-5, FindingLevel.OK), (6, FindingLevel.WARN)]
)
def test_a_jump_since_boot_is_found_in_either_layout_of_utmp(
    computer, layout, jump_s, level
) -> None:
    names = (b"~", b"", b"reboot", b"6.8.0", 0, 0, 0)
    records = [struct.pack(layout, kind, 0, *names, BOOT_S, 0) for kind in (1, 2)]
    computer.write("/run/utmp").write_bytes(b"".join(records))
    computer.write("/proc/stat", f"cpu 1\nbtime {BOOT_S + jump_s}\n")
    (finding,) = clocks.jump_since_boot(computer.context())
    assert finding.level is level
    assert f"{jump_s:+.0f} s" in finding.measured


@pytest.mark.parametrize(
    ("source", "level"), [("tsc", FindingLevel.OK), ("hpet", FindingLevel.WARN)]
)
def test_a_slow_clock_source_is_told(computer, source, level) -> None:
    computer.write("/sys/devices/system/clocksource/clocksource0/current_clocksource", source)
    (finding,) = clocks.clock_source(computer.context())
    assert finding.level is level


def test_the_wall_clock_of_this_machine_is_judged(computer) -> None:
    (finding,) = clocks.wall_time(computer.context())
    assert finding.level in (FindingLevel.OK, FindingLevel.WARN)


@pytest.mark.parametrize(
    ("millidegrees", "level"),
    [
        ("89000", FindingLevel.OK),
        ("89001", FindingLevel.WARN),
        ("99000", FindingLevel.FAIL),
        ("\n", FindingLevel.MISSING),
    ],
)
def test_heat_is_judged_by_the_zones_own_trip_point(computer, millidegrees, level) -> None:
    computer.write(f"{ZONE}/type", "cpu-thermal\n")
    computer.write(f"{ZONE}/temp", millidegrees)
    for number, (kind, value) in enumerate((("active", 50000), ("passive", 99000), ("hot", 0))):
        computer.write(f"{ZONE}/trip_point_{number}_type", kind)
        computer.write(f"{ZONE}/trip_point_{number}_temp", str(value))
    (finding,) = power.heat(computer.context())
    assert finding.level is level


def test_the_supply_faults_since_boot_are_told(board_tree, computer) -> None:
    computer.root = board_tree("orin_nx_16gb")
    (finding,) = power.throttling(computer.context())
    assert finding.level is FindingLevel.WARN
    assert finding.measured == "2 times under-voltage, 1 times average over-current since boot"
    computer.root = board_tree("orin_nano_8gb_super")
    (finding,) = power.throttling(computer.context())
    assert finding.level is FindingLevel.OK


@pytest.mark.parametrize(
    ("board", "profile", "level", "words"),
    [
        ("orin_nx_16gb", "robot", FindingLevel.OK, "25W"),
        ("orin_nx_16gb", "desktop", FindingLevel.OK, "the profile asks for none"),
        ("agx_orin_64gb", "robot", FindingLevel.FAIL, "no mode 25W, only MAXN, 15W, 30W, 50W"),
        ("desktop", "desktop", FindingLevel.MISSING, "there is no /etc/nvpmodel.conf"),
    ],
)
def test_the_power_mode_is_compared_with_the_profiles(
    board_tree, computer, board, profile, level, words
) -> None:
    computer.root = board_tree(board)
    (finding,) = power.power_mode(computer.context(profile))
    assert finding.level is level
    assert words in finding.measured


def test_another_power_mode_is_a_warning_with_the_id_on_this_board(board_tree, computer) -> None:
    computer.root = board_tree("orin_nx_16gb")
    computer.write("/var/lib/nvpmodel/status", "pmode:0001\n")
    (finding,) = power.power_mode(computer.context("robot"))
    assert (finding.level, finding.measured) == (FindingLevel.WARN, "10W, expected 25W")
    assert finding.remedy == "sudo nvpmodel -m 3"


@pytest.mark.parametrize(
    ("found", "level"),
    [(("performance",) * 2, FindingLevel.OK), (("performance", "schedutil"), FindingLevel.WARN)],
)
def test_every_governor_counts(computer, found, level) -> None:
    for number, name in enumerate(found):
        path = f"/sys/devices/system/cpu/cpufreq/policy{number}/scaling_governor"
        computer.write(path, f"{name}\n")
    (finding,) = power.governor(computer.context())
    assert finding.level is level


@pytest.mark.parametrize(
    ("isolated", "profile", "level"),
    [
        ("\n", "desktop", FindingLevel.OK),
        ("\n", "robot", FindingLevel.WARN),
        ("5\n", "robot", FindingLevel.OK),
        ("2-3,5-7\n", "robot", FindingLevel.OK),
        ("2-4\n", "robot", FindingLevel.WARN),
        ("3\n", "desktop", FindingLevel.OK),
    ],
)
def test_isolated_processors_matter_where_control_has_its_own(
    computer, isolated, profile, level
) -> None:
    computer.write("/sys/devices/system/cpu/isolated", isolated)
    (finding,) = power.isolated_processors(computer.context(profile))
    assert finding.level is level


@pytest.mark.parametrize(
    ("board", "profile", "level"),
    [
        ("thor_t5000", "desktop", FindingLevel.WARN),
        ("desktop", "robot", FindingLevel.WARN),
        ("desktop", "desktop", FindingLevel.OK),
    ],
)
def test_the_profile_is_compared_with_the_one_made_for_the_board(
    board_tree, computer, board, profile, level
) -> None:
    computer.root = board_tree(board)
    (finding,) = machine.profile(computer.context(profile))
    assert finding.level is level
