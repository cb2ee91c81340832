"""Run the dashboard as a node: sockets, application, parts and status."""

import logging
from pathlib import Path
from typing import Final

from fastapi import FastAPI

from drivers.clock import NS_PER_S, MonotonicClock
from vla_deploy.client.access.accounts import AccountsFile
from vla_deploy.client.access.errors import AccessError
from vla_deploy.client.access.local_token import provide_local_token
from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.access import AccessControl, AccessRules
from vla_deploy.dashboard.app import create_app
from vla_deploy.dashboard.door_probe import DoorProbe
from vla_deploy.dashboard.parts import Part
from vla_deploy.dashboard.serving import HttpSocket, open_socket
from vla_deploy.ipc import CellWriter, IpcError, topics
from vla_deploy.ipc.payloads.services import DashboardStatus
from vla_deploy.ipc.stop_button import ESTOP
from vla_deploy.runtime.net import DASHBOARD_SOCKET, DashboardSettings, open_port, server_context
from vla_deploy.runtime.node import NodeContext
from vla_deploy.runtime.part_guard import PartGuard

_PUBLISH_NS: Final = NS_PER_S // 2
_EVERYWHERE: Final = {"0.0.0.0": "127.0.0.1", "::": "::1"}
_TRUSTING: Final = (
    "trust_loopback = true: every user of this computer, and every container on its network, may "
    "move the robot; leave it out of dashboard.toml, and log in by: vla-deploy dashboard"
)
_log = logging.getLogger(__name__)


class DashboardNode:
    """Open the sockets, step the parts, and publish the page's address."""

    period_s = 0.05

    def __init__(self, context: NodeContext, settings: DashboardSettings) -> None:
        self._context = context
        self._settings = settings
        self._clock = context.clock
        self.link = RobotLink(context.run_dir, context.clock, robot=context.robot)
        self.app: FastAPI
        self.sockets: tuple[HttpSocket, ...] = ()
        self._parts: list[Part] = []
        self._guard = PartGuard(_log)
        self._access: AccessControl | None = None
        self.probe: DoorProbe | None = None
        self._status: CellWriter[DashboardStatus]
        self._due_ns = 0
        self._url = ""

    def start(self) -> None:
        """Listen; requests wait until they are served.

        Raises:
            PortTaken: another program listens there.
            TlsUnusable: certificate or key cannot be used.
        """
        settings = self._settings
        certificate, key = settings.tls_certificate, settings.tls_key
        tls = server_context(certificate, key) if certificate else None
        twin = self._context.devices_dir is not None  # runs on one computer share its ports
        status = self.link.document(topics.DASHBOARD_STATUS)
        before = None if status is None else status["port"]
        tcp = open_port(settings.host, settings.port, search=twin, before=before)
        unix = open_socket(self._context.run_dir / DASHBOARD_SOCKET)
        self.sockets = (HttpSocket(tcp, tls), HttpSocket(unix))
        self.probe = DoorProbe(tcp, is_tls=tls is not None)
        self._status = self.link.space.cell_writer(topics.DASHBOARD_STATUS)
        # Sessions and limits on guesses run in real time.
        base, rules = self._context.run_dir.parent, _rules(settings)
        self._access = AccessControl.of_base(base, rules, MonotonicClock())
        _provide_token(base, self._access.accounts)
        if settings.trust_loopback:
            _log.warning(_TRUSTING)
        self.app = create_app(self.link, settings, self._access)
        self._parts = self.app.state.parts
        self._port = tcp.getsockname()[1]
        self._url = f"{settings.scheme}://{_reachable(settings.host)}:{self._port}"

    def step(self) -> None:
        """Step the parts, and publish the page's address twice a second, while it is answered."""
        for part in self._parts:
            self._guard.run(type(part).__name__, part.step)
        now_ns = self._clock.now_ns()
        is_silent = self.probe is not None and self.probe.is_silent
        if now_ns >= self._due_ns and not is_silent:
            self._due_ns = now_ns + _PUBLISH_NS
            self._status.put_document(
                {
                    "url": self._url,
                    "port": self._port,
                    "host": self._settings.host,
                    "failures": dict(self._guard.failures),
                }
            )

    def press(self, reason: str) -> bool:
        """Press the stop; return whether it is pressed, else its route tries, and says why not."""
        try:
            self.link.operate(ESTOP, reason)
        except IpcError as error:
            _log.error("the stop is not pressed: %s", error)
            return False
        return True

    def stop(self) -> None:
        """Stop the parts and close everything."""
        for part in self._parts:
            part.stop()
        for one in self.sockets:
            one.listener.close()
        if self._access is not None:
            self._access.close()
        self.link.close()


def _provide_token(base: Path, accounts: AccountsFile) -> None:
    """Make the token of the robot's own user; without it, the Unix socket still knows that user."""
    try:
        provide_local_token(base, accounts)
    except (AccessError, OSError) as error:
        _log.error("no token for the programs of the robot's user: %s", error)


def _rules(settings: DashboardSettings) -> AccessRules:
    return AccessRules(
        trust_loopback=settings.trust_loopback,
        hosts=(*settings.allowed_hosts, settings.host),
        origins=settings.allowed_origins,
        is_https=settings.scheme == "https",
    )


def _reachable(host: str) -> str:
    """Return a host that a browser on this computer can reach; IPv6 in brackets."""
    name = _EVERYWHERE.get(host, host)
    return f"[{name}]" if ":" in name else name
