"""`vla-deploy release keygen | sign`: make a signing key, and sign a wheel with it."""

import argparse
import os
from pathlib import Path
from typing import Final

from vla_deploy.cli.commands import emit
from vla_deploy.cli.errors import UsageError
from vla_deploy.install.building import examined
from vla_deploy.install.minisign import (
    new_key,
    public_key_text,
    secret_key_from,
    secret_key_text,
    sign,
)
from vla_deploy.install.release_keys import RELEASE_KEYS, SIGNATURE_SUFFIX, VERSION_FIELD

_OWNER_ONLY: Final = 0o600


def make_key(arguments: argparse.Namespace) -> int:
    """Write a fresh secret key that only its owner may read, and its public key."""
    secret = _key_file(arguments)
    public = secret.with_suffix(".pub")
    if secret == public:
        raise UsageError(f"--key {secret}: expected the secret key's name, such as release.key")
    for path in (secret, public):
        if path.exists():
            raise UsageError(f"{path} is there already; choose another name: --key FILE")
    key = new_key()
    fd = os.open(secret, os.O_WRONLY | os.O_CREAT | os.O_EXCL, _OWNER_ONLY)
    with os.fdopen(fd, "w") as file:
        file.write(secret_key_text(key))
    public.write_text(public_key_text(key.public))
    document = {"key_id": key.public.key_id, "secret": str(secret), "public": str(public)}
    text = (
        f"key {key.public.key_id}: {secret} has no password, keep it off the robots; "
        f"trust it there: sudo install -D -m 644 {public} {RELEASE_KEYS}/{public.name}"
    )
    return emit(arguments, document, text, indent=None)


def sign_wheel(arguments: argparse.Namespace) -> int:
    """Write the signature next to a wheel."""
    if not arguments.target:
        raise UsageError("release sign: expected a wheel; see: vla-deploy release --help")
    wheel = Path(arguments.target)
    secret = _key_file(arguments)
    key = secret_key_from(secret.read_text(errors="replace"), str(secret))
    checked, _ = examined(wheel, keys=None)
    comment = f"file:{wheel.name}\t{VERSION_FIELD}{checked.version}"
    signature = wheel.with_name(wheel.name + SIGNATURE_SUFFIX)
    signature.write_text(sign(checked.data, key, comment))
    document = {"signature": str(signature), "key_id": key.public.key_id}
    text = f"signed {checked.version} by key {key.public.key_id}: {signature}"
    return emit(arguments, document, text, indent=None)


def _key_file(arguments: argparse.Namespace) -> Path:
    if arguments.key is None:
        raise UsageError(f"release {arguments.act}: expected --key FILE, the secret key")
    key: Path = arguments.key
    return key
