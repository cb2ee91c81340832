"""The server, with the SDK's own client at the other end."""

import json
import sys
from collections.abc import Awaitable, Callable
from functools import partial
from pathlib import Path
from typing import Any

import anyio
import anyio.lowlevel
import pytest
from mcp import Client, StdioServerParameters
from starlette.testclient import TestClient

from drivers.clock import MonotonicClock
from vla_deploy.client.access.accounts import AccountsFile, UserRole, new_token, wall_s
from vla_deploy.client.access.audit_log import AUDIT_FILE, AuditFile, AuditLog
from vla_deploy.gateways.mcp import serving
from vla_deploy.gateways.mcp.errors import McpMissing, NotLoopback
from vla_deploy.gateways.mcp.http_access import TokenCheck, check_loopback
from vla_deploy.gateways.mcp.server import AgentServer
from vla_deploy.gateways.mcp.tools import TOOLS, listed_tools
from vla_deploy.runtime.state_dir import access_dir_of

READ_AND_STOP = {*listed_tools(may_act=False)}


def talk(robot: Any, mode: str, talker: Callable[[Client], Awaitable[None]], **chosen: Any) -> None:
    """Let a client talk with the server in one process."""

    async def main() -> None:
        server = AgentServer(robot.calls, anyio.lowlevel.checkpoint)
        async with Client(server.server, mode=mode, **chosen) as client:
            await talker(client)

    anyio.run(main)


@pytest.mark.parametrize("mode", ["legacy", "auto"])
def test_tools_that_act_are_listed_while_leased(robot, mode):
    async def talker(client: Client) -> None:
        async def names() -> set[str]:
            listed = await client.list_tools(cache_mode="bypass")
            return {tool.name for tool in listed.tools}

        assert await names() == READ_AND_STOP
        refused = await client.call_tool("command", {"text": "go to the kitchen"})
        assert refused.is_error
        assert refused.structured_content["rule"] == "not_leased"
        robot.lease.grant("cli:anna", 1)
        assert await names() == {*TOOLS}
        done = await client.call_tool("command", {"text": "go to the kitchen"})
        assert not done.is_error
        assert json.loads(done.content[0].text) == done.structured_content
        assert done.structured_content["data"]["state"] == "succeeded"
        robot.lease.revoke("cli:anna")
        assert await names() == READ_AND_STOP

    talk(robot, mode, talker)
    assert {entry["user"] for entry in robot.audited()} == {"agent:mcp"}


def test_a_client_hears_of_a_lease(robot):
    async def talker(client: Client) -> None:
        await client.list_tools()
        robot.lease.grant("cli:anna", 1)
        with anyio.fail_after(30):
            await heard.wait()

    async def hear(message: Any) -> None:
        if getattr(message, "method", "") == "notifications/tools/list_changed":
            heard.set()

    heard = anyio.Event()
    talk(robot, "legacy", talker, message_handler=hear)


def test_a_program_starts_the_server_and_talks_over_its_pipes(robot):
    words = ["-m", "vla_deploy.cli", "--runtime-base", str(robot.base), "mcp"]
    root = str(Path(__file__).parents[4])
    program = StdioServerParameters(command=sys.executable, args=words, env={"PYTHONPATH": root})

    async def main() -> None:
        async with Client(program, mode="legacy") as client:
            answer = await client.call_tool("recordings", {"limit": 3})
            assert answer.structured_content["data"] == {"flights": [], "recordings": []}
            assert (await client.call_tool("command", {"text": "go"})).is_error

    anyio.run(main)
    refused, read = AuditFile(access_dir_of(robot.base) / AUDIT_FILE).newest(9)
    assert (read["act"], read["code"], read["details"]["limit"]) == (
        "tool recordings",
        "read_only",
        "3",
    )
    assert (refused["act"], refused["code"]) == ("tool command", "not_leased")


def test_over_http_a_token_names_the_agent(robot):
    accounts = AccountsFile.of_base(robot.base)
    token_id, text, token = new_token("lab", UserRole.VIEWER, wall_s(), lasts_s=60.0)
    accounts.change(lambda held: (held.with_token(token_id, token), None))
    app = AgentServer(robot.calls).http_app()
    guarded = TokenCheck(app, accounts, AuditLog(robot.audit_file, MonotonicClock()))
    call = {
        "jsonrpc": "2.0",
        "id": 1,
        "method": "initialize",
        "params": {
            "protocolVersion": "2025-06-18",
            "capabilities": {},
            "clientInfo": {"name": "somebody", "version": "1"},
        },
    }
    accept = {"accept": "application/json, text/event-stream"}
    with TestClient(guarded, "http://127.0.0.1:8090") as client:
        post = partial(client.post, "/mcp", headers=accept)
        assert post(json=call).status_code == 401
        assert post(json=call, headers={"authorization": "Bearer vla_x"}).status_code == 401
        client.headers["authorization"] = f"Bearer {text}"
        assert post(json=call, headers={"host": "evil.example"}).status_code == 421
        begun = post(json=call)
        assert begun.status_code == 200
        session = accept | {"mcp-session-id": begun.headers["mcp-session-id"]}
        stop = {"name": "stop", "arguments": {}}
        post(json={"jsonrpc": "2.0", "method": "notifications/initialized"}, headers=session)
        answer = post(
            json={"jsonrpc": "2.0", "id": 2, "method": "tools/call", "params": stop},
            headers=session,
        )
        assert answer.json()["result"]["structuredContent"]["rule"] == "stop_always"
    users = [(entry["user"], entry["code"]) for entry in robot.audited()]
    assert users == [("agent:lab", "stop_always"), ("anyone", "token_refused")]


@pytest.mark.parametrize(
    ("host", "is_served"),
    [
        ("127.0.0.1", True),
        ("::1", True),
        ("0.0.0.0", False),
        ("192.168.0.7", False),
        ("::", False),
        ("localhost.evil.example", False),
    ],
)
def test_agents_are_served_on_this_computer_alone(host, is_served):
    if is_served:
        check_loopback(host)
        return
    with pytest.raises(NotLoopback, match="ssh -L"):
        check_loopback(host)


def test_without_the_sdk_the_message_says_how_to_install_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "mcp", None)
    with pytest.raises(McpMissing, match=r"pip install 'vla-deploy\[mcp\]'"):
        serving.serve(tmp_path)
