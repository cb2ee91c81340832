"""Bring a drive's PDOs into the layout that the driver speaks, and verify it (CiA 301).

What is right already is not written: a drive whose layout is fixed only has to have the right one.
"""

from collections.abc import Generator, Iterator
from typing import Final

from drivers.canopen.objects import PDOS, RPDO1, TPDO1, Pdo
from drivers.canopen.parameters import DriveParameters
from drivers.canopen.sdo import Writing

PDO_INVALID: Final = 1 << 31
NO_REMOTE: Final = 1 << 30
PDO_NUMBERS: Final = range(8)


def lay_out_pdos(parameters: DriveParameters, node_id: int, pdos: tuple[Pdo, ...]) -> Writing:
    """Write mapping, transmission type and identifier of each PDO that differs; verify all.

    Raises:
        WrongDevice: the drive does not take the layout.
        NoReply: the drive is silent.
    """
    for pdo in pdos:
        expected = tuple(layout(pdo, node_id))
        if not (yield from _matches(parameters, expected)):
            yield from _write(parameters, pdo, node_id)
            yield from parameters.check(expected)
    yield from _silence_others(parameters)


def layout(pdo: Pdo, node_id: int) -> Iterator[tuple[str, int, int, int]]:
    """List the objects that describe a PDO."""
    yield "PDO identifier", pdo.communication, 1, pdo.cob_base + node_id
    yield "PDO transmission type", pdo.communication, 2, pdo.transmission
    yield "PDO mapped objects", pdo.mapping, 0, len(pdo.entries)
    for subindex, entry in enumerate(pdo.entries, start=1):
        yield "PDO mapping", pdo.mapping, subindex, entry


def _matches(
    parameters: DriveParameters, expected: tuple[tuple[str, int, int, int], ...]
) -> Generator[None, None, bool]:
    for _, index, subindex, value in expected:
        got = yield from parameters.read(index, subindex)
        if got & ~NO_REMOTE != value & ~NO_REMOTE:
            return False
    return True


def _write(parameters: DriveParameters, pdo: Pdo, node_id: int) -> Writing:
    """Write in the order of the standard: off, no entries, entries, count, type, on."""
    cob_id = pdo.cob_base + node_id
    writes = [
        (pdo.communication, 1, cob_id | PDO_INVALID),
        (pdo.mapping, 0, 0),
        *((pdo.mapping, row, entry) for row, entry in enumerate(pdo.entries, start=1)),
        (pdo.mapping, 0, len(pdo.entries)),
        (pdo.communication, 2, pdo.transmission),
        (pdo.communication, 1, cob_id),
    ]
    for index, subindex, value in writes:
        if parameters.dictionary.writable(index, subindex):
            yield from parameters.write(index, subindex, value)


def _silence_others(parameters: DriveParameters) -> Writing:
    """Switch off every PDO that is not ours, so that nothing else moves or loads the bus."""
    ours = {pdo.communication for pdo in PDOS}
    for base in (RPDO1.communication, TPDO1.communication):
        for communication in (base + number for number in PDO_NUMBERS):
            if communication in ours or not parameters.dictionary.writable(communication, 1):
                continue
            cob_id = yield from parameters.read(communication, 1)
            if not cob_id & PDO_INVALID:
                yield from parameters.write(communication, 1, cob_id | PDO_INVALID)
