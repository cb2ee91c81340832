"""Find the declared servers and open them by name."""

import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from drivers.clock import Clock
from vla_deploy.model_servers.calls.exchange import Exchange
from vla_deploy.model_servers.credentials import find_credential, key_folders
from vla_deploy.model_servers.errors import ServerUnknown
from vla_deploy.model_servers.server import ModelServer
from vla_deploy.model_servers.settings import SERVERS_FILE, ServerSettings, read_servers
from vla_deploy.runtime.state_dir import config_dir_of


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerShelf:
    """Hold what `servers.toml` declares, and what opening a server takes."""

    file: Path
    declared: Mapping[str, ServerSettings]
    clock: Clock
    key_folders: tuple[Path, ...] = ()
    draw: Callable[[], float] = random.random

    @classmethod
    def of_base(cls, base: Path, clock: Clock) -> "ServerShelf":
        """Return the shelf for runs in a runtime directory; a run's own is one of its children.

        Raises:
            ServersFileInvalid: the file has faults.
        """
        file = config_dir_of(base) / SERVERS_FILE
        return cls(
            file=file, declared=read_servers(file), clock=clock, key_folders=key_folders(base)
        )

    def open(self, name: str) -> ModelServer:
        """Return a server, ready to be asked; nothing is sent yet.

        Raises:
            ServerUnknown: none of that name is declared.
            CredentialMissing: its key is not there.
        """
        settings = self.declared.get(name)
        if settings is None:
            known = ", ".join(self.declared) or "none"
            raise ServerUnknown(
                f"no server {name!r}: expected one that {self.file} declares ({known})"
            )
        name_of_key = settings.credential
        key = find_credential(name_of_key, self.key_folders) if name_of_key else None
        return ModelServer(name, settings, key, Exchange(settings), self.clock, self.draw)
