import pytest

from vla_deploy.doctor import FindingLevel, power

ZONE = "/sys/class/thermal/thermal_zone0"


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
    ("capacity", "level", "words"),
    [
        ("63", FindingLevel.OK, "63 %"),
        ("?", FindingLevel.WARN, "holds '?', expected a number"),
        (None, FindingLevel.WARN, "no battery is in /sys/class/power_supply"),
    ],
)
def test_the_batterys_gauge_is_read(computer, capacity, level, words) -> None:
    if capacity is not None:
        computer.write("/sys/class/power_supply/BAT0/type", "Battery")
        computer.write("/sys/class/power_supply/BAT0/capacity", capacity)
    (finding,) = power.battery(computer.context(robot="butler"))
    assert finding.level is level
    assert words in finding.measured
