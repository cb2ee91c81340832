"""Check Python, packages, models, OpenGL, the systemd unit and the dashboard."""

import importlib.metadata
import importlib.util
import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

from platforms.tree import ValueMissing
from vla_deploy.doctor.context import DoctorContext
from vla_deploy.doctor.finding import DoctorFinding, fail, missing, ok, warn
from vla_deploy.inference.errors import InferenceError, ModelUnknown
from vla_deploy.inference.store import ModelStore
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

PROJECT: Final = "vla-deploy"
EGL_SCRIPT: Final = Path(__file__).with_name("egl.py")
OLDEST_PYTHON: Final = (3, 11)
NEWEST_PYTHON: Final = (3, 13)
GL_PACKAGES: Final = "sudo apt-get install -y libegl1 libgl1-mesa-dri libopengl0"
UNIT: Final = "vla-deploy.service"
UNIT_FOLDERS: Final = ("/etc/systemd/system", "/usr/lib/systemd/system", "/lib/systemd/system")
# Import name, the extra that brings it, what it is for.
EXTRAS: Mapping[str, tuple[str, str]] = {
    "sounddevice": ("audio", "microphone and speaker"),
    "faster_whisper": ("speech", "spoken commands"),
    "gpiod": ("gpio", "an e-stop button on a GPIO line"),
    "pynvml": ("nvml", "the load of NVIDIA cards, and of Thor's GPU"),
}
_NAME: Final = re.compile(r"^[A-Za-z0-9._-]+")


def python(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check the interpreter's version."""
    del context
    version = sys.version_info[:2]
    measured = ".".join(map(str, sys.version_info[:3]))
    if OLDEST_PYTHON <= version <= NEWEST_PYTHON:
        yield ok("Python", measured)
    else:
        wanted = f"{'.'.join(map(str, OLDEST_PYTHON))} to {'.'.join(map(str, NEWEST_PYTHON))}"
        yield fail("Python", f"{measured}, expected {wanted}", "uv python install 3.12")


def packages(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that every required package is installed, and which extras are."""
    del context
    required = importlib.metadata.requires(PROJECT) or [] if _installed(PROJECT) else []
    names = [_name(row) for row in required if "extra ==" not in row]
    absent = [name for name in names if not _installed(name)]
    if absent:
        yield fail("packages", f"without {', '.join(absent)}", f"pip install {' '.join(absent)}")
    else:
        yield ok("packages", f"all {len(names)} installed")
    for module, (extra, purpose) in EXTRAS.items():
        if importlib.util.find_spec(module) is None:
            remedy = f"pip install '{PROJECT}[{extra}]'"
            yield missing(f"extra {extra}", f"not installed; only for {purpose}", remedy)
        else:
            yield ok(f"extra {extra}", "installed")


def _name(requirement: str) -> str:
    found = _NAME.match(requirement)
    return found.group() if found else requirement


def _installed(name: str) -> bool:
    try:
        importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return False
    return True


def models(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check that the models which the profile names are there, and whole."""
    wanted = context.profile.models if context.profile else {}
    if not wanted:
        yield ok("models", "the profile names none")
    for role, choice in wanted.items():
        faults = [fault for tier in choice.tiers if (fault := _fault_of(context.models, tier))]
        if faults:
            yield warn(role, "; ".join(faults), "vla-deploy models list")
        else:
            yield ok(role, ", ".join(choice.tiers))


def _fault_of(store: ModelStore, name: str) -> str:
    """Read a whole model; return what keeps it from being used."""
    try:
        model = store.load(name)
        for variant in model.manifest.files:
            model.checked_file(variant)
        model.check_parts()
    except ModelUnknown:
        return f"no model {name}"
    except InferenceError as error:
        return str(error)
    return ""


def open_gl(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Open EGL in a process of its own: a broken driver may crash it."""
    try:
        yield ok("OpenGL (EGL)", context.ask((sys.executable, str(EGL_SCRIPT))).strip())
    except ValueMissing as missing_egl:
        yield warn("OpenGL (EGL)", f"{missing_egl}; the twin draws nothing", GL_PACKAGES)


def service(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Return how the systemd unit is, if it is installed."""
    if not any(context.tree.exists(f"{folder}/{UNIT}") for folder in UNIT_FOLDERS):
        yield missing("service", f"{UNIT} is not installed", "sudo vla-deploy install")
        return
    rows = context.ask(("systemctl", "show", UNIT, "--property=ActiveState,NRestarts,Result"))
    state = dict(row.partition("=")[::2] for row in rows.splitlines())
    measured = (
        f"{state.get('ActiveState')}, {state.get('NRestarts')} restarts, "
        f"last result {state.get('Result')}"
    )
    if state.get("ActiveState") == "active":
        yield ok("service", measured)
    elif state.get("ActiveState") == "failed":
        yield fail("service", measured, f"journalctl -u {UNIT} -n 50")
    else:
        yield warn("service", measured, f"sudo systemctl enable --now {UNIT}")


_DASHBOARD: Final = "dashboard"
_LOOPBACK: Final = frozenset({"127.0.0.1", "::1", "localhost"})


def dashboard(context: DoctorContext) -> Iterator[DoctorFinding]:
    """Check settings, ports and certificate of the user who runs the robot on this computer."""
    base = default_base()
    file = config_dir_of(base) / SETTINGS_FILE
    try:
        settings = read_settings(base)
    except DashboardSettingsInvalid as error:
        yield fail(_DASHBOARD, "; ".join(error.faults), f"sudoedit {file}")
        return
    yield from _ports(settings, is_running=running(base) is not None)
    yield from _encryption(settings, file)


def _ports(settings: DashboardSettings, *, is_running: bool) -> Iterator[DoctorFinding]:
    for name, port in (("page", settings.port), ("stop door", settings.stop_port)):
        label = f"{_DASHBOARD}, {name}"
        if is_running:
            yield ok(label, f"a robot runs; see: vla-deploy {_DASHBOARD}")
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
            yield warn(f"{_DASHBOARD}, TLS", told, f"sudoedit {file}  # tls_certificate, tls_key")
        return
    try:
        server_context(settings.tls_certificate, settings.tls_key)
    except TlsUnusable as error:
        yield fail(f"{_DASHBOARD}, TLS", str(error), f"sudoedit {file}")
    else:
        yield ok(f"{_DASHBOARD}, TLS", f"{settings.tls_certificate} can be used")
