"""Judge what feeds the servos of a bus: in the robot file, and by what the servos measure."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from typing import Final

from drivers.errors import UnknownModel
from drivers.servo.family import ServoFacts, family_of
from vla_deploy.robots.consistency import Document, repeats, rows, table
from vla_deploy.robots.devices import Servo, ServoBus
from vla_deploy.runtime.table_schema import TableFault, is_number

_LOWEST_RATIO: Final = 0.75
_HIGHEST_RATIO: Final = 1.2
"""What a supply may give, as shares of its nominal voltage (chosen): three lithium cells of 11.1 V
give 9.9 V to 12.6 V, and a 12 V supply at a servo for 5 V is far outside."""


def supplies_feed_each_servo(document: Document) -> Iterator[TableFault]:
    """Each servo hangs on one supply, where supplies are declared at all."""
    bus = table(document, "servo_bus")
    declared = rows(bus, "supplies")
    if "supplies" not in bus:
        return
    fed: list[tuple[str, object]] = []
    for i, row in enumerate(declared):
        ids = row.get("servos")
        fed += [(f"servo_bus.supplies[{i}].servos", one) for one in _ids(ids)]
    names = [(f"servo_bus.supplies[{i}].name", row.get("name")) for i, row in enumerate(declared)]
    yield from repeats([*names, *fed])
    known = {row["id"] for row in _servo_rows(bus) if isinstance(row.get("id"), int)}
    for key, one in fed:
        if one not in known:
            yield TableFault(key=key, got=repr(one), expected="ids of the servos of this bus")
    for one in sorted(known - {one for _, one in fed}, key=str):
        got = f"none that feeds servo {one}"
        yield TableFault(key="servo_bus.supplies", got=got, expected="each servo on one supply")


def supplies_suit_servos(document: Document) -> Iterator[TableFault]:
    """Servos stand their supply; where none is declared, that is what the first servo needs."""
    bus, facts = table(document, "servo_bus"), _facts(document)
    for i, row in enumerate(rows(bus, "supplies")):
        volts = row.get("voltage_v")
        for one in _ids(row.get("servos")):
            if one in facts and is_number(volts) and not _stands(facts[one][1], volts):
                yield TableFault(
                    key=f"servo_bus.supplies[{i}].voltage_v",
                    got=f"{volts:g} V",
                    expected=f"what {_needs(one, *facts[one])}",
                )
    if facts and "supplies" not in bus:
        first = next(iter(facts))
        volts = facts[first][1].nominal_v
        for one, (model, needed) in facts.items():
            if not _stands(needed, volts):
                yield TableFault(
                    key="servo_bus.supplies",
                    got=f"nothing, so {volts:g} V for all, as servo {first} needs",
                    expected=f"a table for each supply: {_needs(one, model, needed)}",
                )
                return


def _stands(facts: ServoFacts, volts: float) -> bool:
    low, high = facts.voltage_limits_v
    return low <= volts <= high


def _needs(servo_id: int, model: str, facts: ServoFacts) -> str:
    low, high = facts.voltage_limits_v
    return f"servo {servo_id} ({model}) stands: {low:g}..{high:g} V"


CHECKS: Final[tuple[Callable[[Document], Iterator[TableFault]], ...]] = (
    supplies_feed_each_servo,
    supplies_suit_servos,
)


def voltage_range_v(bus: ServoBus, servo: Servo, margin_v: float = 0.0) -> tuple[float, float]:
    """Return which voltages are plausible at a servo: of its supply, `margin_v` inside its limits.

    A bus without declared supplies has only the limits of the servo's model.
    """
    low, high = family_of(servo.model).facts(servo.model).voltage_limits_v
    low, high = low + margin_v, high - margin_v
    if supply := bus.supply_of(servo.id):
        low = max(low, _LOWEST_RATIO * supply.voltage_v)
        high = min(high, _HIGHEST_RATIO * supply.voltage_v)
    return low, high


def voltage_mismatches(bus: ServoBus, volts: Mapping[int, float]) -> list[str]:
    """Return a line for each supply whose servos measure what it cannot give; ids name servos."""
    found: dict[str, list[str]] = {}
    for servo in bus.all_servos:
        low, high = voltage_range_v(bus, servo)
        if servo.id in volts and not low <= volts[servo.id] <= high:
            supply = bus.supply_of(servo.id)
            name = f"supply {supply.name} ({supply.voltage_v:g} V)" if supply else "the supply"
            found.setdefault(name, []).append(
                f"servo {servo.id} ({servo.joint}) has {volts[servo.id]:.1f} V, "
                f"expected {low:.1f}..{high:.1f} V"
            )
    return [f"{supply}: {'; '.join(servos)}" for supply, servos in found.items()]


def _servo_rows(bus: Document) -> list[Document]:
    return [row for kind in ("servos", "shadows", "wheels") for row in rows(bus, kind)]


def _ids(value: object) -> list[int]:
    return [one for one in value if isinstance(one, int)] if isinstance(value, list) else []


def _facts(document: Document) -> dict[int, tuple[str, ServoFacts]]:
    """Return model and facts of each servo by its id; unknown models are another check's."""
    found: dict[int, tuple[str, ServoFacts]] = {}
    for row in _servo_rows(table(document, "servo_bus")):
        servo_id, model = row.get("id"), row.get("model")
        if isinstance(servo_id, int) and isinstance(model, str):
            with suppress(UnknownModel):
                found[servo_id] = (model, family_of(model).facts(model))
    return found
