"""Group the errors of model servers by what the caller can do about them.

ModelServerError
├── ServersFileInvalid     servers.toml has faults: correct every one that is listed
├── ServerUnknown          no server of that name is declared: name another one
├── CredentialMissing      the key is not there, or is no key: provide it
├── PrivacyRefused         may not leave the robot: allow it in servers.toml, or ask a local one
├── ServerRefused          the server will not answer this: correct model, key, address or request
├── Unavailable            there is no answer now: do without it, or ask another server
│   ├── Busy               too many calls wait already
│   ├── CircuitOpen        it has failed too often: it is left alone for a while
│   ├── ServerUnreachable  no connection, or it broke
│   ├── TimedOut           the answer would come too late
│   └── ServerFailed       it says that it cannot now, also after all retries
└── AnswerUnusable         an answer came that is none: do without it
    ├── AnswerTooLarge     more bytes than allowed
    ├── AnswerMalformed    not what this kind of server sends, or no JSON in it
    ├── AnswerEmpty        no text in it
    ├── AnswerTruncated    the model ran out of tokens
    ├── AnswerRefused      the model declines
    └── AnswerInvalid      JSON, but not of the shape asked for; carries every fault
"""


class ModelServerError(Exception):
    """Base of everything that model servers raise."""


class ServersFileInvalid(ModelServerError):
    """Report every fault of servers.toml at once."""

    def __init__(self, faults: tuple[str, ...]) -> None:
        super().__init__("\n".join(faults))
        self.faults = faults


class ServerUnknown(ModelServerError):
    """Say that no server of a name is declared."""


class CredentialMissing(ModelServerError):
    """Say where a key was looked for."""


class PrivacyRefused(ModelServerError):
    """Say what would have left the robot, and that nothing did."""


class ServerRefused(ModelServerError):
    """Say why a server refuses a request; `status` is that of HTTP, 0 where it was not sent."""

    def __init__(self, message: str, status: int = 0) -> None:
        super().__init__(message)
        self.status = status


class Unavailable(ModelServerError):
    """Say that a server gives no answer now."""


class Busy(Unavailable):
    """Say that too many calls wait for a server."""


class CircuitOpen(Unavailable):
    """Say that a server is left alone for a while after repeated failures."""


class ServerUnreachable(Unavailable):
    """Say that there is no connection to a server; `was_sent` where it broke after the request."""

    def __init__(self, message: str, *, was_sent: bool) -> None:
        super().__init__(message)
        self.was_sent = was_sent


class TimedOut(Unavailable):
    """Say which time has run out."""


class ServerFailed(Unavailable):
    """Say that a server cannot answer now; `wait_s` is how long it asks to be left alone."""

    def __init__(self, message: str, status: int, wait_s: float | None = None) -> None:
        super().__init__(message)
        self.status = status
        self.wait_s = wait_s


class AnswerUnusable(ModelServerError):
    """Say that an answer cannot be used."""


class AnswerTooLarge(AnswerUnusable):
    """Say that an answer was cut off because it is too large."""


class AnswerMalformed(AnswerUnusable):
    """Say what was expected in an answer and is not there."""


class AnswerEmpty(AnswerUnusable):
    """Say that an answer has no text."""


class AnswerTruncated(AnswerUnusable):
    """Say that the model ran out of tokens before its answer was whole."""


class AnswerRefused(AnswerUnusable):
    """Say that the model declines to answer."""


class AnswerInvalid(AnswerUnusable):
    """Say everything that is wrong with an answer's shape."""

    def __init__(self, faults: tuple[str, ...]) -> None:
        super().__init__("the answer has the wrong shape: " + "; ".join(faults))
        self.faults = faults
