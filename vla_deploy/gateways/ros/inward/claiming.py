"""Hold parts of the robot while they are moved from the graph, so that no plan moves them too."""

from collections.abc import Sequence

from vla_deploy.client.link import RobotLink
from vla_deploy.ipc import ClaimBook
from vla_deploy.ipc.errors import ClaimRefused


class Claimed:
    """Ask for some of the robot's parts, all or none; waiting for them is not offered."""

    def __init__(self, link: RobotLink, holder: str, parts: Sequence[str]) -> None:
        self.is_held = False
        self._book = ClaimBook(link.space, link.clock)
        self._holder = holder
        self._wants = dict.fromkeys(parts, 1)

    def why_not_taken(self) -> str:
        """Take them, or return who has them; holding them already is fine."""
        if self.is_held:
            return ""
        try:
            self.is_held = self._book.ask(self._holder, self._wants)
        except ClaimRefused as error:
            return str(error)
        if self.is_held:
            return ""
        self._book.release(self._holder)
        return self._book.obstacles(self._wants) or "another command was faster"

    def release(self) -> None:
        """Give them back."""
        self._book.release(self._holder)
        self.is_held = False
