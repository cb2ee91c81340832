"""Check heat, throttling, power mode and processor clocks."""

from collections.abc import Iterable, Iterator
from typing import Final

from platforms.probes import open_probes, read_power_modes
from platforms.probes.battery import CHARGE, FOLDER, PowerSupplySource
from platforms.probes.thermal import ZONES
from platforms.tree import Tree, ValueMissing, number_in
from vla_deploy.doctor.context import DoctorContext, boot_option
from vla_deploy.doctor.finding import DoctorFinding, fail, missing, ok, warn
from vla_deploy.robots.battery_settings import BatterySource

MARGIN_K: Final = 10.0
TRIPS: Final = frozenset({"passive", "hot", "critical"})
THROTTLE_WORDS: Final = {"oc1": "under-voltage", "oc2": "average over-current"}
GOVERNOR: Final = "performance"
_CPUFREQ: Final = "/sys/devices/system/cpu/cpufreq"
_WATCH: Final = "vla-deploy probes --watch 1"


def heat(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check the margin of each thermal zone to where the kernel slows the computer down."""
    margins = sorted(_margins(context.tree))
    if not margins:
        yield missing("temperature", f"no zone in {ZONES} tells temperature and trip point")
        return
    margin_k, zone, value_c, trip_c = margins[0]
    measured = f"{zone} {value_c:.0f} degC, throttles at {trip_c:.0f} degC"
    if margin_k <= 0:
        yield fail("temperature", measured, f"{_WATCH}   # clean the fan, free the air")
    elif margin_k < MARGIN_K:
        yield warn("temperature", measured, _WATCH)
    else:
        yield ok("temperature", measured)


def _margins(tree: Tree) -> Iterator[tuple[float, str, float, float]]:
    for folder in tree.names(ZONES):
        if not folder.startswith("thermal_zone"):
            continue
        zone = f"{ZONES}/{folder}"
        try:
            name = tree.text(f"{zone}/type")
            value_c = number_in(tree.text(f"{zone}/temp"), zone) / 1000
            trip_c = min(_trips_c(tree, zone))
        except (ValueMissing, ValueError):  # a zone that sleeps, or has no trip point
            continue
        yield trip_c - value_c, name, value_c, trip_c


def _trips_c(tree: Tree, zone: str) -> Iterator[float]:
    for name in tree.names(zone):
        if name.startswith("trip_point_") and name.endswith("_type"):
            kind = tree.text(f"{zone}/{name}")
            value_c = number_in(tree.text(f"{zone}/{name.replace('_type', '_temp')}"), zone) / 1000
            if kind in TRIPS and value_c > 0:
                yield value_c


def throttling(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Return how often the supply made the board slow down since boot."""
    with open_probes(context.tree.root, nvml=False) as probes:
        readings = probes.read()
    known = [readings[f"throttle_count.{counter}"] for counter in THROTTLE_WORDS]
    measured = ", ".join(
        f"{reading.value:g} times {words}"
        for reading, words in zip(known, THROTTLE_WORDS.values(), strict=True)
        if reading.value is not None
    )
    if not measured:
        yield missing("throttling", known[0].reason.removeprefix("missing, because "))
    elif any(reading.value for reading in known):
        remedy = f"{_WATCH}   # is the supply too weak?"
        yield warn("throttling", f"{measured} since boot", remedy)
    else:
        yield ok("throttling", f"{measured} since boot")


def power_mode(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Compare the board's power mode with the one that the profile asks for."""
    modes = read_power_modes(context.tree)
    wanted = context.profile.power_mode if context.profile else ""
    ids = {_plain(name): number for number, name in modes.names.items()}
    current = _plain(modes.current_name or "")
    if modes.current is None:
        yield missing("power mode", modes.reason)
    elif not wanted or current == _plain(wanted):
        asked = "" if wanted else ", the profile asks for none"
        yield ok("power mode", f"{modes.current_name}{asked}")
    elif _plain(wanted) not in ids:
        measured = f"the board has no mode {wanted}, only {', '.join(ids)}"
        yield fail("power mode", measured, "vla-deploy profile detect")
    else:
        measured = f"{modes.current_name}, expected {wanted}"
        yield warn("power mode", measured, f"sudo nvpmodel -m {ids[_plain(wanted)]}")


def _plain(mode: str) -> str:
    return mode.removeprefix("MODE_")  # which some releases write before it


def governor(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that the processors do not lower their clock between two ticks."""
    files = [
        f"{_CPUFREQ}/{name}/scaling_governor"
        for name in context.tree.names(_CPUFREQ)
        if name.startswith("policy")
    ]
    if not files:
        yield missing("CPU governor", f"{_CPUFREQ} has no policy: the kernel does not set clocks")
        return
    found = sorted({context.tree.text(path) for path in files})
    if found == [GOVERNOR]:
        yield ok("CPU governor", GOVERNOR)
    else:
        remedy = f"echo {GOVERNOR} | sudo tee {_CPUFREQ}/policy*/scaling_governor"
        yield warn("CPU governor", f"{', '.join(found)}, expected {GOVERNOR}", remedy)


def isolated_processors(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that the kernel keeps others off the processors that control has for itself."""
    isolated = context.tree.text("/sys/devices/system/cpu/isolated")
    wanted = context.profile.processes["control"].affinity if context.profile else ()
    if not wanted or not (context.profile and context.profile.realtime_priority):
        yield ok("isolated CPUs", f"{isolated or 'none'}, and the profile needs none")
        return
    shared = sorted(set(wanted) - _processors(isolated))
    if not shared:
        yield ok("isolated CPUs", isolated)
        return
    remedy = boot_option(context.tree, f"isolcpus={_listed(wanted)}")
    measured = f"{isolated or 'none'}; control runs on {_listed(shared)} beside others"
    yield warn("isolated CPUs", measured, remedy)


def _processors(listed: str) -> set[int]:
    """Read a list of the kernel's, such as `2-3,5`."""
    found: set[int] = set()
    for part in filter(None, listed.split(",")):
        first, _, last = part.partition("-")
        if not first.isdecimal() or not (last or first).isdecimal():
            raise ValueMissing(f"/sys/devices/system/cpu/isolated says {listed[:40]!r}")
        found.update(range(int(first), int(last or first) + 1))
    return found


def _listed(processors: Iterable[int]) -> str:
    return ",".join(map(str, processors))


def battery(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Read the gauge that the robot file names."""
    settings = None if context.robot is None else context.robot.battery
    if settings is None:
        yield missing("battery", "the robot file has no [battery]")
    elif settings.source is BatterySource.SERVOS:
        yield ok("battery", "its voltage comes from the servos")
    else:
        source = PowerSupplySource(context.tree, settings.supply)
        charge = next(one for one in source.readings() if one.name == CHARGE)
        if charge.value is None:
            why = charge.reason.removeprefix("missing, because ")
            yield warn("battery", why, f"ls {FOLDER}   # [battery] supply names one of them")
        else:
            yield ok("battery", f"{100 * charge.value:.0f} %")
