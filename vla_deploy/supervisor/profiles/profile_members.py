"""Know under which profile each running process is, whatever it was started with."""

from collections.abc import Mapping
from typing import Final

from vla_deploy.supervisor.profiles.profile_change import Member

CONTROL: Final = "control"


class Allegiance:
    """Remember who took over a profile while it ran, and who may have failed to go back."""

    def __init__(self) -> None:
        self._adopted: dict[str, int] = {}
        self._doubtful: dict[str, int] = {}

    def adopt(self, pids: Mapping[str, int]) -> None:
        """Take note of who has taken over the profile in force; nobody else has."""
        self._adopted = dict(pids)
        self._doubtful = {}

    def doubt(self, pids: Mapping[str, int]) -> None:
        """Take note of who has not said that it went back."""
        self._doubtful = dict(pids)

    def strangers(
        self, members: Mapping[str, Member], profile: str, *, may_restart_control: bool
    ) -> tuple[str, ...]:
        """Name who does not surely run under `profile`, and may be started again for it."""
        return tuple(
            name
            for name, member in members.items()
            if self._is_stranger(name, member, profile) and (name != CONTROL or may_restart_control)
        )

    def _is_stranger(self, name: str, member: Member, profile: str) -> bool:
        if self._doubtful.get(name) == member.pid:
            return True
        return member.started_under != profile and self._adopted.get(name) != member.pid
