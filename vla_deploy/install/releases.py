"""Keep releases side by side, one of them in use.

<prefix>/releases/<id>/   a release: its own environment, `bin/vla-deploy`, and its `release.json`
<prefix>/current          link to the release in use
<prefix>/previous         link to the one that was in use before it
<prefix>/trial            exists while a new release has to prove itself; read by `release-guard`
"""

import os
import re
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from vla_deploy.install.disk import point, sync_folder, write_file
from vla_deploy.install.errors import ReleaseRefused
from vla_deploy.install.release_record import ReleaseRecord, record_of

_ID: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+-]{0,63}")
BOOT_ID: Final = Path("/proc/sys/kernel/random/boot_id")


@dataclass(frozen=True, slots=True, kw_only=True)
class ReleaseTrial:
    """Hold the release on trial, the one it replaced, and its watcher's pid and boot."""

    to: str
    origin: str
    boot: str
    watcher: int

    def as_text(self) -> str:
        """Return the lines that a shell script can read."""
        return f"to={self.to}\nfrom={self.origin}\nboot={self.boot}\nwatcher={self.watcher}\n"


class ReleaseStore:
    """Read and change the folder of releases."""

    def __init__(self, prefix: Path, boot_id: Path = BOOT_ID) -> None:
        self.prefix = prefix
        self._boot_id = boot_id

    def ids(self) -> tuple[str, ...]:
        """Return every release, the oldest first."""
        folders = [path for path in self._releases.glob("*") if _is_release(path)]
        folders.sort(key=lambda path: (path.stat().st_mtime_ns, path.name))
        return tuple(path.name for path in folders)

    def folder(self, release_id: str) -> Path:
        """Return the folder of a release.

        Raises:
            ReleaseRefused: there is no such release; the message lists those there are.
        """
        if release_id not in self.ids():
            listed = ", ".join(self.ids()) or "none"
            raise ReleaseRefused(
                f"no release {release_id!r} in {self._releases}; there are: {listed}; "
                "add one: vla-deploy release add WHEEL"
            )
        return self._releases / release_id

    def records(self) -> dict[str, ReleaseRecord]:
        """Return what is recorded of each release, the oldest first."""
        return {release: record_of(self._releases / release) for release in self.ids()}

    def current(self) -> str:
        """Return the release in use, empty when there is none."""
        return self._target("current")

    def previous(self) -> str:
        """Return the release that was in use before, empty when there is none."""
        return self._target("previous")

    def use(self, release_id: str) -> None:
        """Point `current` to a release in one step; the empty id removes the link."""
        if release_id:
            point(self.prefix / "current", f"releases/{release_id}")
            return
        (self.prefix / "current").unlink(missing_ok=True)
        sync_folder(self.prefix)

    def remember_previous(self, release_id: str) -> None:
        """Name the release to go back to."""
        if release_id:
            point(self.prefix / "previous", f"releases/{release_id}")

    def trial(self) -> ReleaseTrial | None:
        """Return the trial that is under way or was interrupted."""
        file = self.prefix / "trial"
        if not file.is_file():
            return None
        lines = dict(line.split("=", 1) for line in file.read_text().splitlines())
        return ReleaseTrial(
            to=lines["to"],
            origin=lines["from"],
            boot=lines["boot"],
            watcher=int(lines["watcher"]),
        )

    def boot(self) -> str:
        """Return the id of this boot of the computer."""
        return self._boot_id.read_text().strip()

    def begin_trial(self, release_id: str) -> None:
        """Write down, before anything changes, what to go back to."""
        trial = ReleaseTrial(
            to=release_id,
            origin=self.current(),
            boot=self.boot(),
            watcher=os.getpid(),
        )
        (self.prefix / "trial-started").unlink(missing_ok=True)
        write_file(self.prefix / "trial", trial.as_text(), 0o644)

    def end_trial(self) -> None:
        """Forget the trial: the release in use stays."""
        (self.prefix / "trial").unlink(missing_ok=True)
        (self.prefix / "trial-started").unlink(missing_ok=True)
        sync_folder(self.prefix)

    def undo_trial(self, trial: ReleaseTrial) -> None:
        """Go back to what was in use before the trial; twice does no harm."""
        self.use(trial.origin)
        self.end_trial()

    def last_rollback(self) -> str:
        """Return why a release was taken back at a start, empty when none ever was."""
        file = self.prefix / "last-rollback"
        return file.read_text().strip() if file.is_file() else ""

    def incoming(self, release_id: str) -> Path:
        """Return an empty folder to build a release in.

        Raises:
            ReleaseRefused: the id is taken, or is no good name for a folder.
        """
        if not _ID.fullmatch(release_id):
            raise ReleaseRefused(
                f"release id {release_id!r}: expected letters, digits and . _ + - only; "
                "choose another with --id"
            )
        if release_id in self.ids():
            raise ReleaseRefused(
                f"release {release_id} is there already; choose another name with --id, or "
                f"remove it: vla-deploy release remove {release_id}"
            )
        folder = self._releases / f".incoming-{release_id}"
        if folder.exists():
            shutil.rmtree(folder)  # what an interrupted add has left
        folder.mkdir(parents=True)
        return folder

    def accept(self, release_id: str) -> Path:
        """Give a release that is built its final name."""
        folder = self._releases / release_id
        os.sync()  # every file of it is on the disk before its name is
        (self._releases / f".incoming-{release_id}").rename(folder)
        sync_folder(self._releases)
        return folder

    def remove(self, release_id: str) -> None:
        """Remove a release.

        Raises:
            ReleaseRefused: it is unknown, in use, or the one to go back to.
        """
        folder = self.folder(release_id)
        for word, kept in (("in use", self.current()), ("the one to go back to", self.previous())):
            if release_id == kept:
                raise ReleaseRefused(f"release {release_id} is {word}; switch to another first")
        for left in self._releases.glob(".leaving-*"):
            shutil.rmtree(left)  # what an interrupted removal has left
        leaving = self._releases / f".leaving-{release_id}"
        folder.rename(leaving)
        sync_folder(self._releases)  # else its name may come back after its files have gone
        shutil.rmtree(leaving)

    def prune(self, keep: int) -> tuple[str, ...]:
        """Remove the oldest releases beyond `keep`, never the current or the previous one."""
        needed = {self.current(), self.previous()}
        spare = [release for release in self.ids() if release not in needed]
        surplus = max(0, len(self.ids()) - keep)
        for release in spare[:surplus]:
            self.remove(release)
        return tuple(spare[:surplus])

    @property
    def _releases(self) -> Path:
        return self.prefix / "releases"

    def _target(self, link: str) -> str:
        path = self.prefix / link
        return path.readlink().name if path.is_symlink() else ""


def _is_release(path: Path) -> bool:
    return path.is_dir() and not path.name.startswith(".")
