"""Emulate all Dynamixel servos on one bus, as a device behind a line."""

from collections.abc import Sequence

from drivers.dynamixel.wire.codec import Packet
from sim_twin.servos.firmware.coupling import Coupling
from sim_twin.servos.firmware.firmware import Firmware
from sim_twin.servos.protocol.instructions import BrokenPacket, InstructionParser
from sim_twin.servos.protocol.protocol import BusProtocol
from sim_twin.servos.protocol.timing import WireTiming
from sim_twin.servos.spec import EmulatedServoSpec, FirmwareOptions, check_ids
from sim_twin.servos.wire_bank import WireBank


class ServoBank(WireBank[Packet | BrokenPacket]):
    """Be the Dynamixel servos of one bus. Without `coupling` the joints are the shafts.
    `feeds` has the number of the supply of each servo, from 0; without it one feeds all.

    A bus watchdog that has run out trips when time is taken over, and a fast read ends where a
    servo says nothing.

    Raises:
        ValueError: there are no servos, or two of them share an id.
    """

    def __init__(
        self,
        servos: Sequence[EmulatedServoSpec],
        options: FirmwareOptions | None = None,
        timing: WireTiming | None = None,
        coupling: Coupling | None = None,
        feeds: Sequence[int] | None = None,
    ) -> None:
        check_ids([servo.id for servo in servos])
        options = options or FirmwareOptions()
        firmware = Firmware(servos, options, coupling, feeds)
        super().__init__(firmware, BusProtocol(firmware, options), InstructionParser(), timing)
