"""Read, write and check the objects of one drive as numbers, step by step."""

from collections.abc import Generator, Iterable

from drivers.canopen.eds import DriveDictionary
from drivers.canopen.sdo import SdoClient, Writing
from drivers.errors import WrongDevice

Counting = Generator[None, None, int]
Expected = Iterable[tuple[str, int, int, int]]


class DriveParameters:
    """Know one drive's dictionary and its SDO client."""

    def __init__(self, client: SdoClient, dictionary: DriveDictionary, name: str) -> None:
        self.dictionary = dictionary
        self.name = name
        self._client = client

    def read(self, index: int, subindex: int = 0) -> Counting:
        """Return a numeric object.

        Raises:
            NoReply: the drive is silent.
            WrongDevice: the drive has no such object.
            ProtocolError: the reply does not fit the request or the object's type.
        """
        data = yield from self._client.upload(index, subindex)
        return self.dictionary.decode(index, subindex, data)

    def write(self, index: int, subindex: int, value: int) -> Writing:
        """Write an object in its declared type.

        Raises:
            NoReply: the drive is silent.
            WrongDevice: the EDS file or the drive refuses the value.
            ProtocolError: the reply does not fit the request.
        """
        data = self.dictionary.encode(index, subindex, value)
        yield from self._client.download(index, subindex, data)

    def check(self, expected: Expected) -> Writing:
        """Compare objects with what is expected of them; pass over those the drive does not have.

        Raises:
            WrongDevice: one differs.
        """
        for what, index, subindex, value in expected:
            if self.dictionary.has(index, subindex):
                got = yield from self.read(index, subindex)
                if got != value:
                    raise self.differs(what, index, subindex, got, value)

    def differs(self, what: str, index: int, subindex: int, got: int, value: int) -> WrongDevice:
        """Return the error of an object that is not what it should be."""
        return WrongDevice(
            f"{self.name}: {what} 0x{index:04X}:{subindex:X} is 0x{got:X}, expected 0x{value:X}; "
            "correct the robot file or the drive's configuration"
        )
