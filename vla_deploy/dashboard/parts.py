"""Declare what works in the dashboard beside its requests, stepped in the event loop."""

import time
from collections.abc import Callable
from typing import Final, Protocol

from fastapi import FastAPI

from vla_deploy.client.command_history import CommandHistory
from vla_deploy.dashboard.alarms.part import alarm_desk
from vla_deploy.dashboard.live import live
from vla_deploy.dashboard.metering import metering


class Part(Protocol):
    """Do a bit of work many times a second, and never wait: all clients share the event loop."""

    def step(self) -> None:
        """Look at the topics and do what is new."""
        ...

    def stop(self) -> None:
        """Let go of what the part holds."""
        ...


def _commands(app: FastAPI) -> Part:
    app.state.commands = CommandHistory(app.state.link, time.time_ns)
    part: Part = app.state.commands
    return part


# Each is made with the app, finds `link` and `settings` in its state, and puts there what routes
# want to find.
PARTS: Final[tuple[Callable[[FastAPI], Part], ...]] = (live, _commands, alarm_desk, metering)
