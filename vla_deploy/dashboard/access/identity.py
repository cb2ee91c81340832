"""Say who asks, how that is known, and what they may do."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from vla_deploy.client.access.accounts import Role

IDENTITY: Final = "identity"
"""The name under which a request's state holds who asks."""


class Way(StrEnum):
    """Name how somebody is known."""

    NONE = "none"
    LOOPBACK = "loopback"
    SOCKET = "socket"
    SESSION = "session"
    TOKEN = "token"


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """Describe who asks.

    `user` is the name of an account, of a token, or of the way; `address` is where the connection
    comes from. `csrf` is what a session's changes must repeat, and empty for other ways.
    """

    role: Role
    user: str
    way: Way
    address: str
    csrf: str = ""

    @property
    def source(self) -> str:
        """Return the name that stop, commands and acts carry into the robot."""
        return f"dashboard:{self.user}"


def nobody(address: str) -> Identity:
    """Return who asks where nothing is known of them."""
    return Identity(role=Role.ANYONE, user="anyone", way=Way.NONE, address=address)
