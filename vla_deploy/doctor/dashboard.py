"""Check that the dashboard and its stop door can listen, and whom they let in how."""

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from vla_deploy.doctor.context import DoctorContext
from vla_deploy.doctor.finding import DoctorFinding, fail, ok, warn
from vla_deploy.runtime.net import (
    SETTINGS_FILE,
    DashboardSettings,
    DashboardSettingsInvalid,
    PortTaken,
    TlsUnusable,
    open_port,
    read_settings,
    server_context,
)
from vla_deploy.runtime.state_dir import config_dir_of
from vla_deploy.supervisor.runs.runtime import default_base, running

_NAME: Final = "dashboard"
_LOOPBACK: Final = frozenset({"127.0.0.1", "::1", "localhost"})


def dashboard(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check settings, ports and certificate of the user who runs the robot on this computer."""
    base = default_base()
    file = config_dir_of(base) / SETTINGS_FILE
    try:
        settings = read_settings(base)
    except DashboardSettingsInvalid as error:
        yield fail(_NAME, "; ".join(error.faults), f"sudoedit {file}")
        return
    yield from _ports(settings, is_running=running(base) is not None)
    yield from _encryption(settings, file)


def _ports(settings: DashboardSettings, *, is_running: bool) -> Iterator[DoctorFinding]:
    for name, port in (("page", settings.port), ("stop door", settings.stop_port)):
        label = f"{_NAME}, {name}"
        if is_running:
            yield ok(label, f"a robot runs; see: vla-deploy {_NAME}")
            continue
        try:
            open_port(settings.host, port, search=False).close()
        except PortTaken as error:
            yield warn(label, str(error), f"sudo ss -ltnp 'sport = :{port}'")
        else:
            yield ok(label, f"{settings.host}:{port} is free")


def _encryption(settings: DashboardSettings, file: Path) -> Iterator[DoctorFinding]:
    """Check that passwords do not travel in the clear, and that the certificate can be read."""
    if settings.scheme == "http":
        if settings.host not in _LOOPBACK:
            told = f"{settings.host} is reached from elsewhere without TLS: passwords can be read"
            yield warn(f"{_NAME}, TLS", told, f"sudoedit {file}  # tls_certificate, tls_key")
        return
    try:
        server_context(settings.tls_certificate, settings.tls_key)
    except TlsUnusable as error:
        yield fail(f"{_NAME}, TLS", str(error), f"sudoedit {file}")
    else:
        yield ok(f"{_NAME}, TLS", f"{settings.tls_certificate} can be used")
