"""List the error codes of emergency messages and 603F (CiA 301, CiA 402-2), and who may reset them.

A code that is not listed itself is what its group is: its first two digits, or its first.
"""

from typing import Final

from drivers.wheel_drives.bus import ResetRule

CODE_TEXTS: Final[dict[int, str]] = {
    0x0000: "error reset",
    0x2110: "short circuit or earth leakage at the input",
    0x2120: "earth leakage at the input",
    0x2211: "continuous over-current inside the device, no. 1",
    0x2220: "continuous over-current inside the device",
    0x2310: "continuous over-current",
    0x2320: "short circuit or earth leakage at the motor",
    0x2330: "earth leakage at the motor",
    0x2340: "short circuit at the motor",
    0x2350: "load level fault, I2t thermal state",
    0x2360: "load level warning, I2t thermal state",
    0x3110: "mains over-voltage",
    0x3120: "mains under-voltage",
    0x3130: "phase failure",
    0x3210: "DC link over-voltage",
    0x3211: "DC link over-voltage, no. 1",
    0x3220: "DC link under-voltage",
    0x3230: "DC link load fault",
    0x3310: "motor over-voltage",
    0x3320: "motor under-voltage",
    0x3330: "motor voltage phase fault",
    0x4110: "ambient temperature too high",
    0x4120: "ambient temperature too low",
    0x4210: "device over-temperature",
    0x4220: "device temperature too low",
    0x4310: "drive over-temperature",
    0x4320: "drive temperature too low",
    0x5111: "supply +15 V low",
    0x5112: "supply +24 V low",
    0x5113: "supply +5 V low",
    0x5210: "measurement circuit",
    0x5220: "computing circuit",
    0x5410: "output stages",
    0x5430: "input stages",
    0x5440: "contacts",
    0x5510: "RAM",
    0x5520: "ROM",
    0x5530: "non-volatile memory",
    0x6010: "software reset by watchdog",
    0x6100: "internal software",
    0x6310: "loss of parameters",
    0x6320: "parameter fault",
    0x7110: "brake chopper",
    0x7112: "brake chopper over-current",
    0x7121: "motor blocked",
    0x7122: "motor commutation fault",
    0x7300: "sensor",
    0x7301: "tachometer fault",
    0x7303: "resolver 1 fault",
    0x7305: "encoder fault",
    0x7306: "incremental sensor 2 fault",
    0x7310: "speed sensor",
    0x7320: "position sensor",
    0x7500: "communication inside the device",
    0x8100: "communication",
    0x8110: "CAN overrun",
    0x8120: "CAN in error passive mode",
    0x8130: "heartbeat of the master lost",
    0x8140: "recovered from bus off",
    0x8150: "CAN identifier collision",
    0x8200: "protocol fault",
    0x8210: "PDO not processed, wrong length",
    0x8220: "PDO longer than mapped",
    0x8240: "SYNC with a wrong length",
    0x8250: "RPDO timeout",
    0x8311: "excess torque",
    0x8331: "torque fault",
    0x8400: "velocity controller",
    0x8480: "velocity feedback speed too high",
    0x8500: "position controller",
    0x8611: "following error",
    0x8612: "reference limit",
    0x8700: "SYNC controller",
    0x8A00: "external position",
    0x9000: "external error",
    0xF001: "deceleration",
    0xF002: "sub-synchronous run",
    0xF004: "control",
    0xFF00: "manufacturer specific",
}
GROUP_TEXTS: Final[dict[int, str]] = {
    0x0: "error reset",
    0x1: "generic error",
    0x2: "current",
    0x21: "current at the input",
    0x22: "current inside the device",
    0x23: "current at the motor",
    0x3: "voltage",
    0x31: "mains voltage",
    0x32: "voltage inside the device",
    0x33: "motor voltage",
    0x4: "temperature",
    0x41: "ambient temperature",
    0x42: "device temperature",
    0x43: "drive temperature",
    0x5: "device hardware",
    0x6: "device software",
    0x61: "internal software",
    0x62: "user software",
    0x63: "data record",
    0x7: "additional modules",
    0x71: "power section",
    0x73: "sensor",
    0x8: "monitoring",
    0x81: "communication",
    0x82: "protocol",
    0x9: "external error",
    0xF: "device specific",
}

# Communication comes back by itself; damage does not go by a command.
CODE_RULES: Final[dict[int, ResetRule]] = {
    0x2110: ResetRule.NEVER,
    0x2120: ResetRule.NEVER,
    0x2320: ResetRule.NEVER,
    0x2330: ResetRule.NEVER,
    0x2340: ResetRule.NEVER,
    0x8110: ResetRule.AUTOMATIC,
    0x8120: ResetRule.AUTOMATIC,
    0x8130: ResetRule.AUTOMATIC,
    0x8140: ResetRule.AUTOMATIC,
    0x8250: ResetRule.AUTOMATIC,
}
GROUP_RULES: Final[dict[int, ResetRule]] = {
    0x5: ResetRule.NEVER,
    0x61: ResetRule.NEVER,
    0x73: ResetRule.NEVER,
}


def code_text(code: int) -> str:
    """Return a code with its meaning in words."""
    text = CODE_TEXTS.get(code) or GROUP_TEXTS.get(code >> 8) or GROUP_TEXTS.get(code >> 12)
    return f"0x{code:04X} {text or 'reserved code'}"


def reset_rule(code: int) -> ResetRule:
    """Return who may reset a fault of that code."""
    for table, key in ((CODE_RULES, code), (GROUP_RULES, code >> 8), (GROUP_RULES, code >> 12)):
        if key in table:
            return table[key]
    return ResetRule.OPERATOR
