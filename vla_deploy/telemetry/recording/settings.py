"""Read `recording.toml`: whether to record always, how much to keep, where to serve viewers."""

import ipaddress
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from vla_deploy.runtime.state_dir import config_dir_of
from vla_deploy.runtime.table_schema import parse_toml
from vla_deploy.telemetry.errors import RecordingSettingsInvalid
from vla_deploy.telemetry.folder import FolderBounds
from vla_deploy.telemetry.recording.request import EVERYTHING, RecordingRequest

SETTINGS_FILE: Final = "recording.toml"
_STRICT: Final = ConfigDict(frozen=True, extra="forbid", strict=True)


class RecordingSettings(BaseModel):
    """Configure what is always recorded, and the bounds of files and folder."""

    model_config = _STRICT

    always: bool = False
    topics: list[str] = Field(default=list(EVERYTHING), min_length=1)
    without: list[str] = []
    file_mb: float = Field(default=128.0, ge=1.0, le=4096.0)
    file_s: float = Field(default=600.0, ge=5.0, le=86400.0)
    total_mb: float = Field(default=4096.0, ge=10.0)
    spare_mb: float = Field(default=1024.0, ge=0.0)
    files: int = Field(default=500, ge=2, le=100_000)
    image_period_s: float = Field(default=0.5, ge=0.05, le=3600.0)

    @property
    def bounds(self) -> FolderBounds:
        """Return the bounds of the folder."""
        return FolderBounds(
            files=self.files,
            total_bytes=round(self.total_mb * 1e6),
            spare_bytes=round(self.spare_mb * 1e6),
        )

    @property
    def request(self) -> RecordingRequest:
        """Return the recording that is always made."""
        return RecordingRequest(
            topics=tuple(self.topics),
            without=tuple(self.without),
            label="always",
            source=SETTINGS_FILE,
        )


class FoxgloveSettings(BaseModel):
    """Configure where viewers are served live, and which topics they get."""

    model_config = _STRICT

    host: str = "127.0.0.1"
    port: int = Field(default=8765, ge=0, le=65535)
    open_to_network: bool = False
    topics: list[str] = Field(default=list(EVERYTHING), min_length=1)
    without: list[str] = []

    @model_validator(mode="after")
    def _stays_here(self) -> "FoxgloveSettings":
        try:
            address = ipaddress.ip_address(self.host)
        except ValueError as error:
            raise ValueError(f"host: expected an IP address, got {self.host!r}") from error
        if not address.is_loopback and not self.open_to_network:
            raise ValueError(
                f"host {self.host}: whoever reaches it sees everything, without a password; "
                "set open_to_network = true if that is wanted"
            )
        return self


class TelemetrySettings(BaseModel):
    """Hold the whole file."""

    model_config = _STRICT

    recording: RecordingSettings = RecordingSettings()
    foxglove: FoxgloveSettings = FoxgloveSettings()


def read_settings(base: Path) -> TelemetrySettings:
    """Return the settings of the runs of a runtime directory; the defaults where there is no file.

    Raises:
        RecordingSettingsInvalid: it is no TOML, or has faults; all of them are listed.
    """
    file = config_dir_of(base) / SETTINGS_FILE
    try:
        document = parse_toml(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return TelemetrySettings()
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise RecordingSettingsInvalid((f"{file}: expected a TOML document: {error}",)) from error
    try:
        return TelemetrySettings.model_validate(document)
    except ValidationError as error:
        raise RecordingSettingsInvalid(tuple(_faults(file, error))) from error


def _faults(file: Path, error: ValidationError) -> Iterator[str]:
    for fault in error.errors(include_url=False):
        place = ".".join(str(part) for part in fault["loc"])
        yield f"{file}: {place}: {fault['msg'].removeprefix('Value error, ')}"
