"""Load certificate and key for https, and say what is wrong with them; standard library alone."""

import ssl
from pathlib import Path
from typing import NoReturn

from vla_deploy.dashboard.errors import TlsUnusable

_OTHERS: int = 0o077


def server_context(certificate: str, key: str) -> ssl.SSLContext:
    """Return the TLS context of a server, for TLS 1.2 and later.

    Raises:
        TlsUnusable: a file is missing, may not be read, is no PEM, needs a password or does not
            belong to the other; or others may read the key.
    """
    for setting, path in (("tls_certificate", certificate), ("tls_key", key)):
        try:
            with Path(path).open("rb"):
                pass
        except OSError as error:
            raise TlsUnusable(
                f"{setting} {path}: {error.strerror}; the robot's user has to be able to read it, "
                "below /etc/vla-deploy for the service"
            ) from error
    if Path(key).stat().st_mode & _OTHERS & ~0o040:
        raise TlsUnusable(f"tls_key {key}: others may read it, expected: chmod 640 {key}, or 600")
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        context.load_cert_chain(certificate, key, password=lambda: _refuse_password(key))
    except ssl.SSLError as error:
        raise TlsUnusable(
            f"tls_certificate {certificate}, tls_key {key}: {error.reason or error}; expected PEM "
            "files that belong together, the robot's own certificate first"
        ) from error
    return context


def _refuse_password(key: str) -> NoReturn:
    """Refuse rather than ask: nobody sits at the robot when it starts."""
    raise TlsUnusable(
        f"tls_key {key}: it needs a password, expected a key without: openssl pkey -in {key}"
    )
