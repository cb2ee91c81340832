"""Group the errors of shared memory by what the caller can do about them.

IpcError
├── UnknownTopic        no such topic, or another kind of topic: fix the call
├── BadPayload          the payload does not fit the topic's declaration: fix the sender
├── SchemaMismatch      the file was made by another version: stop the whole run, start it again
├── SpaceUnavailable    the directory or its memory cannot be had: free memory, check permissions
├── ReplayOnly          the run is a replay of a file: nothing can be asked of it
└── ClaimRefused        a resource can never be granted as it was asked for: fix the claim
"""


class IpcError(Exception):
    """Base of everything that shared memory raises."""


class UnknownTopic(IpcError):
    """Say that the schema table has no such topic of that kind."""


class BadPayload(IpcError):
    """Say that a payload does not fit what its topic declares."""


class SchemaMismatch(IpcError):
    """Say that a shared file was made with another layout."""


class SpaceUnavailable(IpcError):
    """Say that the shared directory or its memory cannot be had."""


class ClaimRefused(IpcError):
    """Say which resource can never be granted as it was asked for."""


class ReplayOnly(IpcError):
    """Say that a run only shows what was recorded, so that no act reaches any robot."""
