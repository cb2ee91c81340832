"""Emulate all FEETECH servos on one bus, as a device behind a line."""

from collections.abc import Sequence

from drivers.feetech.codec import FeetechPacket, FeetechParser
from sim_twin.servos.feetech.firmware import FeetechFirmware
from sim_twin.servos.feetech.protocol import FeetechProtocol
from sim_twin.servos.feetech.spec import EmulatedFeetechSpec, FeetechOptions
from sim_twin.servos.firmware.coupling import Coupling
from sim_twin.servos.protocol.timing import WireTiming
from sim_twin.servos.spec import check_ids
from sim_twin.servos.wire_bank import WireBank


class FeetechBank(WireBank[FeetechPacket]):
    """Be the FEETECH servos of one bus. Without `coupling` the joints are the shafts.
    `feeds` has the number of the supply of each servo, from 0; without it one feeds all.

    There is no bus watchdog: a servo whose host falls silent keeps its torque and its goal.

    Raises:
        ValueError: there are no servos, or two of them share an id.
    """

    def __init__(
        self,
        servos: Sequence[EmulatedFeetechSpec],
        options: FeetechOptions | None = None,
        timing: WireTiming | None = None,
        coupling: Coupling | None = None,
        feeds: Sequence[int] | None = None,
    ) -> None:
        check_ids([servo.id for servo in servos])
        firmware = FeetechFirmware(servos, options or FeetechOptions(), coupling, feeds)
        super().__init__(firmware, FeetechProtocol(firmware), FeetechParser(), timing)
