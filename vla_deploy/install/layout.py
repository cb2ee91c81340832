"""Say where everything lies on the robot's computer."""

from dataclasses import dataclass
from pathlib import Path

SERVICE = "vla-deploy.service"
SERVICE_RUNTIME = Path("/run/vla-deploy")
STATE_FOLDERS = (
    Path("/var/lib/vla-deploy"),
    Path("/var/log/vla-deploy"),
    Path("/etc/vla-deploy"),
)
# What the releases leave in the prefix, apart from the files that the manifest lists.
RELEASE_FILES = ("releases", "current", "previous", "trial", "trial-started", "last-rollback")
DEFAULT_PREFIX = Path("/opt/vla-deploy")


@dataclass(frozen=True, slots=True, kw_only=True)
class InstallLayout:
    """Name the folders; `root` is put in front of each when it is written, never into a text.

    `ip` is the program that sets network links up, `nvpmodel` the one that sets power modes.
    """

    root: Path = Path("/")
    prefix: Path = DEFAULT_PREFIX
    user: str = "vla-deploy"
    ip: str = "/sbin/ip"
    nvpmodel: str = "/usr/sbin/nvpmodel"

    def on_disk(self, path: Path) -> Path:
        """Return where a file of the robot lies as seen from here."""
        return self.root / path.relative_to("/")

    @property
    def is_this_computer(self) -> bool:
        """Return whether this is the running system, not a folder that stands for one."""
        return self.root == Path("/")

    @property
    def manifest(self) -> Path:
        """Return the file that says what was installed."""
        return self.prefix / "manifest.json"

    @property
    def is_installation(self) -> bool:
        """Return whether the prefix holds what `install` or a release has put there."""
        releases = self.on_disk(self.prefix / "releases")
        return self.on_disk(self.manifest).is_file() or any(releases.glob("*/bin/vla-deploy"))
