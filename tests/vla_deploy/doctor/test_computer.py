import struct
from collections import namedtuple

import pytest

from vla_deploy.doctor import FindingLevel
from vla_deploy.doctor import computer as machine

BOOT_S = 1_763_700_000
Room = namedtuple("Room", "f_bavail f_frsize")


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
    (finding,) = machine.jump_since_boot(computer.context())
    assert finding.level is level
    assert f"{jump_s:+.0f} s" in finding.measured


@pytest.mark.parametrize(
    ("source", "level"), [("tsc", FindingLevel.OK), ("hpet", FindingLevel.WARN)]
)
def test_a_slow_clock_source_is_told(computer, source, level) -> None:
    computer.write("/sys/devices/system/clocksource/clocksource0/current_clocksource", source)
    (finding,) = machine.clock_source(computer.context())
    assert finding.level is level


def test_the_wall_clock_of_this_machine_is_judged(computer) -> None:
    (finding,) = machine.wall_time(computer.context())
    assert finding.level in (FindingLevel.OK, FindingLevel.WARN)


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


@pytest.mark.parametrize(
    ("free_mb", "level"),
    [
        (2000, FindingLevel.OK),
        (1999, FindingLevel.WARN),
        (500, FindingLevel.WARN),
        (499, FindingLevel.FAIL),
    ],
)
def test_disks_are_judged_by_what_the_profile_keeps_free(
    computer, monkeypatch, free_mb, level
) -> None:
    monkeypatch.setattr(machine.os, "statvfs", lambda path: Room(free_mb * 1000, 1000))
    findings = list(machine.disks(computer.context()))
    assert [one.level for one in findings] == [level, level]
    assert "/var/lib/vla-deploy" in findings[0].measured


@pytest.mark.parametrize(("free_mb", "level"), [(300, FindingLevel.OK), (268, FindingLevel.FAIL)])
def test_shared_memory_needs_room(computer, monkeypatch, free_mb, level) -> None:
    monkeypatch.setattr(machine.os, "statvfs", lambda path: Room(free_mb * 1000, 1000))
    (finding,) = machine.shared_memory(computer.context())
    assert finding.level is level


@pytest.mark.parametrize(
    ("total", "free", "swaps", "level", "words"),
    [
        (0, 0, "", FindingLevel.OK, "none"),
        (
            1000000,
            500000,
            "/dev/zram0 partition 1 1 5\n",
            FindingLevel.OK,
            "zram, 512 of 1024 MB used",
        ),
        (1000000, 1000000, "/swapfile file 1 0 -2\n", FindingLevel.OK, "0 of 1024 MB used"),
        (
            1000000,
            999000,
            "/swapfile file 1 1 -2\n",
            FindingLevel.WARN,
            "/swapfile, 1 of 1024 MB used",
        ),
    ],
)
def test_swap_on_a_disk_that_is_used_is_told(computer, total, free, swaps, level, words) -> None:
    computer.write("/proc/meminfo", f"SwapTotal:  {total} kB\nSwapFree:  {free} kB\n")
    computer.write("/proc/swaps", f"Filename Type Size Used Priority\n{swaps}")
    (finding,) = machine.swap(computer.context())
    assert finding.level is level
    assert words in finding.measured
