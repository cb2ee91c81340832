"""Read the vendor's `flat_endpoints.json`: which number each property of a firmware has.

Numbers differ between firmware versions, so a file serves only the version that it names. The file
beside this module describes emulated axes, which call themselves firmware 0.0.0.
"""

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from drivers.errors import DeviceMissing, WrongDevice

EMULATED_ENDPOINTS: Final = Path(__file__).with_name("flat_endpoints.json")

WATCHDOG_TIMEOUT: Final = "axis0.config.watchdog_timeout"
ENABLE_WATCHDOG: Final = "axis0.config.enable_watchdog"
HEARTBEAT_RATE: Final = "axis0.config.can.heartbeat_msg_rate_ms"
ENCODER_RATE: Final = "axis0.config.can.encoder_msg_rate_ms"
VELOCITY_LIMIT: Final = "axis0.controller.config.vel_limit"
RAMP_RATE: Final = "axis0.controller.config.vel_ramp_rate"

NEEDED: Final = (WATCHDOG_TIMEOUT, ENABLE_WATCHDOG)
VALUE_BYTES: Final = 4
_LAYOUTS: Final[Mapping[str, struct.Struct]] = {
    name: struct.Struct(f"<{layout}")
    for name, layout in {
        "bool": "?xxx",
        "float": "f",
        "uint8": "Bxxx",
        "int8": "bxxx",
        "uint16": "Hxx",
        "int16": "hxx",
        "uint32": "I",
        "int32": "i",
    }.items()
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Endpoint:
    """Name one property with its number and its type."""

    name: str
    number: int
    layout: struct.Struct

    def encode(self, value: float) -> bytes:
        """Return the four bytes of a value."""
        return self.layout.pack(value)

    def decode(self, data: bytes) -> float:
        """Return the value of four bytes."""
        (value,) = self.layout.unpack(data)
        return float(value)


@dataclass(frozen=True, slots=True, kw_only=True)
class EndpointTable:
    """Hold the properties of one firmware version."""

    path: Path
    firmware: str
    endpoints: Mapping[str, Endpoint]


@lru_cache(maxsize=8)
def read_endpoints(path: Path) -> EndpointTable:
    """Read the vendor's file.

    Raises:
        DeviceMissing: there is no such file.
        WrongDevice: it is not such a file, or lacks what arms the watchdog.
    """
    what = f"endpoint file {path}"
    try:
        document = json.loads(path.read_text())
        endpoints = {name: _endpoint(name, row) for name, row in document["endpoints"].items()}
        firmware = str(document["fw_version"])
    except OSError as error:
        raise DeviceMissing(
            f"{what}: {error.strerror}. Load flat_endpoints.json of the axes' firmware from the "
            "vendor's release page and name it as `endpoints` in the robot file"
        ) from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise WrongDevice(f"{what} is no flat_endpoints.json of the vendor: {error!r}") from error
    known = {name: each for name, each in endpoints.items() if each is not None}
    missing = [name for name in NEEDED if name not in known]
    if missing:
        raise WrongDevice(f"{what} lacks {', '.join(missing)}: the watchdog cannot be armed")
    return EndpointTable(path=path, firmware=firmware, endpoints=known)


def _endpoint(name: str, row: Mapping[str, Any]) -> Endpoint | None:
    """Return one property; functions and types longer than a frame are passed over."""
    layout = _LAYOUTS.get(str(row.get("type")))
    return None if layout is None else Endpoint(name=name, number=int(row["id"]), layout=layout)
