"""Start serving agents; what needs the SDK is imported here, late."""

from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

import anyio

from drivers.clock import MonotonicClock
from vla_deploy.client.access.accounts import AccountsFile
from vla_deploy.client.access.audit_log import AuditLog
from vla_deploy.gateways.mcp.acting import RobotActs
from vla_deploy.gateways.mcp.calls import AgentCalls
from vla_deploy.gateways.mcp.errors import McpMissing
from vla_deploy.gateways.mcp.reading import RobotReader
from vla_deploy.gateways.mcp.robot_access import RobotAccess
from vla_deploy.runtime.executors import low_priority_thread


def serve(base: Path, http: tuple[str, int] | None = None) -> None:
    """Serve the agent that has started this process, or with `http` those of this computer.

    Raises:
        McpMissing: the SDK is not installed.
        NotLoopback: the address is not of this computer.
    """
    server_module = _needs_sdk("server")
    audit = AuditLog.of_base(base, MonotonicClock(), low_priority_thread(MonotonicClock()))
    access = RobotAccess(base)
    reader = RobotReader(RobotAccess(base))
    calls = AgentCalls(access, RobotActs(access), reader, audit)
    server = server_module.AgentServer(calls)
    try:
        if http is None:
            anyio.run(server.serve_stdio)
            return
        http_access = _needs_sdk("http_access")
        app = http_access.TokenCheck(server.http_app(), AccountsFile.of_base(base), audit)
        anyio.run(partial(http_access.serve_http, app, *http))
    finally:
        calls.close()


def _needs_sdk(module: str) -> ModuleType:
    if find_spec("mcp") is None:
        raise McpMissing
    return import_module(f"vla_deploy.gateways.mcp.{module}")
