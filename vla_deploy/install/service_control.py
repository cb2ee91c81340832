"""Ask systemd about the service, restart it, and judge over a while whether it is well."""

from dataclasses import dataclass, replace
from typing import Protocol

from drivers.clock import NS_PER_S, Clock
from vla_deploy.install.commands import run_command
from vla_deploy.install.errors import SystemCommandFailed
from vla_deploy.install.layout import SERVICE
from vla_deploy.supervisor.status_line import trouble_in

_POLL_NS = NS_PER_S // 5


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceState:
    """Say whether the service is ready, which process it is after how many restarts, in its words.

    `status` is its own account of its processes, "" where it gives none.
    """

    active: str
    main_pid: int
    restarts: int
    status: str = ""


class ServiceControl(Protocol):
    """Restart one service and tell its state."""

    def restart(self) -> None:
        """Restart it; return when it is ready.

        Raises:
            SystemCommandFailed: it did not become ready.
        """

    def state(self) -> ServiceState:
        """Return its state.

        Raises:
            SystemCommandFailed: the service manager does not answer.
        """


class SystemdService:
    """Restart the robot's service by systemctl."""

    def __init__(self, unit: str = SERVICE) -> None:
        self._unit = unit

    def restart(self) -> None:
        """Restart it, also when it had been given up; return when it is ready."""
        run_command(["systemctl", "reset-failed", self._unit])
        run_command(["systemctl", "restart", self._unit])

    def state(self) -> ServiceState:
        """Return its state."""
        properties = "--property=ActiveState,MainPID,NRestarts,StatusText"
        text = run_command(["systemctl", "show", properties, self._unit])
        values = dict(line.split("=", 1) for line in text.splitlines() if "=" in line)
        try:
            return ServiceState(
                active=values["ActiveState"],
                main_pid=int(values["MainPID"]),
                restarts=int(values["NRestarts"]),
                status=values.get("StatusText", ""),
            )
        except (KeyError, ValueError) as error:
            raise SystemCommandFailed(
                f"systemctl show {self._unit}: cannot read {text!r}"
            ) from error


def trouble_within(service: ServiceControl, clock: Clock, healthy_s: float, known: str = "") -> str:
    """Watch a service that is ready; return what went wrong, empty when it stays well.

    systemd restarts what fails or misses its watchdog: another process is a failure. A process of
    the robot that fails or is late is one, too, unless the trouble was `known` before.

    Raises:
        SystemCommandFailed: the service manager does not answer.
    """
    first = now = service.state()
    if first.active != "active":
        return f"the service is {first.active}, expected active"
    end_ns = clock.now_ns() + round(healthy_s * NS_PER_S)
    while True:
        if replace(now, status=first.status) != first:
            return f"it became {now.active} after {now.restarts - first.restarts} restarts"
        if trouble_in(now.status) not in ("", known):
            return f"it says: {now.status}"
        if clock.now_ns() >= end_ns:
            return ""
        clock.sleep_until(clock.now_ns() + _POLL_NS)
        now = service.state()


def known_trouble(service: ServiceControl) -> str:
    """Return the trouble that a service has already; none where it does not run or answer."""
    try:
        now = service.state()
    except SystemCommandFailed:
        return ""
    return trouble_in(now.status) if now.active == "active" else ""
