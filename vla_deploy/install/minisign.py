"""Read, verify and make signatures in the file format of minisign.

Format: https://jedisct1.github.io/minisign/#signature-format. Only prehashed signatures ("ED":
Ed25519 over the BLAKE2b-512 of the file) are taken, which minisign makes by default since 0.10.
"""

import base64
import binascii
import hashlib
import os
from dataclasses import dataclass
from typing import Final

from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey

from vla_deploy.install.errors import SignatureRefused

_KEY: Final = b"Ed"
_PREHASHED: Final = b"ED"
_NO_PASSWORD: Final = b"\0\0"
_BLAKE2B: Final = b"B2"
_ID_BYTES: Final = 8
_KEY_BYTES: Final = 32
_SIGNATURE_BYTES: Final = 64
_KDF_BYTES: Final = 48  # salt, opslimit and memlimit of scrypt: zero in a key without a password
_UNTRUSTED: Final = "untrusted comment: "
_TRUSTED: Final = "trusted comment: "
_MAKE_ONE: Final = "make one: vla-deploy release keygen --key FILE"


@dataclass(frozen=True, slots=True, kw_only=True)
class SigningPublicKey:
    """Hold a public key; `key_id` is how signatures name it."""

    key_id: str
    point: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class SigningKey:
    """Hold a secret key without a password."""

    id_bytes: bytes
    seed: bytes

    @property
    def public(self) -> SigningPublicKey:
        """Return the key that verifies what this one signs."""
        point = Ed25519PrivateKey.from_private_bytes(self.seed).public_key().public_bytes_raw()
        return SigningPublicKey(key_id=_shown(self.id_bytes), point=point)


@dataclass(frozen=True, slots=True, kw_only=True)
class FileSignature:
    """Hold a signature as its file has it."""

    key_id: str
    signature: bytes
    trusted_comment: str
    comment_signature: bytes


def new_key() -> SigningKey:
    """Return a fresh secret key."""
    seed = Ed25519PrivateKey.generate().private_bytes_raw()
    return SigningKey(id_bytes=os.urandom(_ID_BYTES), seed=seed)


def public_key_from(text: str, where: str) -> SigningPublicKey:
    """Read a public key file.

    Raises:
        SignatureRefused: it is none.
    """
    data = _blob(text, where, "minisign public key", len(_KEY) + _ID_BYTES + _KEY_BYTES)
    if data[:2] != _KEY:
        raise SignatureRefused(f"{where}: expected a minisign public key (Ed25519); {_MAKE_ONE}")
    return SigningPublicKey(key_id=_shown(data[2 : 2 + _ID_BYTES]), point=data[2 + _ID_BYTES :])


def public_key_text(key: SigningPublicKey) -> str:
    """Return the public key file of a key."""
    data = _KEY + bytes.fromhex(key.key_id)[::-1] + key.point
    return f"{_UNTRUSTED}minisign public key {key.key_id}\n{_coded(data)}\n"


def secret_key_from(text: str, where: str) -> SigningKey:
    """Read a secret key file.

    Raises:
        SignatureRefused: it is none, or is protected by a password.
    """
    size = 6 + _KDF_BYTES + _ID_BYTES + 2 * _KEY_BYTES + _KEY_BYTES
    data = _blob(text, where, "minisign secret key", size)
    if data[:2] != _KEY or data[4:6] != _BLAKE2B:
        raise SignatureRefused(f"{where}: expected a minisign secret key (Ed25519); {_MAKE_ONE}")
    if data[2:4] != _NO_PASSWORD:
        raise SignatureRefused(
            f"{where}: the key has a password, which only minisign itself can take: "
            f"minisign -S -s {where} -m WHEEL"
        )
    key = data[6 + _KDF_BYTES :]
    return SigningKey(id_bytes=key[:_ID_BYTES], seed=key[_ID_BYTES : _ID_BYTES + _KEY_BYTES])


def secret_key_text(key: SigningKey) -> str:
    """Return the secret key file of a key, which has no password."""
    pair = key.seed + key.public.point
    checksum = hashlib.blake2b(_KEY + key.id_bytes + pair, digest_size=32).digest()
    head = _KEY + _NO_PASSWORD + _BLAKE2B + bytes(_KDF_BYTES)
    return (
        f"{_UNTRUSTED}minisign secret key without a password\n"
        f"{_coded(head + key.id_bytes + pair + checksum)}\n"
    )


def sign(data: bytes, key: SigningKey, trusted_comment: str) -> str:
    """Return the signature file of `data`."""
    secret = Ed25519PrivateKey.from_private_bytes(key.seed)
    signature = secret.sign(hashlib.blake2b(data).digest())
    comment_signature = secret.sign(signature + trusted_comment.encode())
    return (
        f"{_UNTRUSTED}signature from minisign secret key\n"
        f"{_coded(_PREHASHED + key.id_bytes + signature)}\n"
        f"{_TRUSTED}{trusted_comment}\n{_coded(comment_signature)}\n"
    )


def signature_from(text: str, where: str) -> FileSignature:
    """Read a signature file.

    Raises:
        SignatureRefused: it is none, or not a prehashed one.
    """
    lines = text.splitlines()
    if len(lines) < 4 or not lines[2].startswith(_TRUSTED):
        raise SignatureRefused(f"{where}: expected the four lines of a minisign signature")
    data = _blob(text, where, "minisign signature", 2 + _ID_BYTES + _SIGNATURE_BYTES)
    if data[:2] != _PREHASHED:
        raise SignatureRefused(
            f"{where}: expected a prehashed signature (ED), got {data[:2]!r}; sign without -l, "
            "by minisign 0.10 or newer or by: vla-deploy release sign"
        )
    return FileSignature(
        key_id=_shown(data[2 : 2 + _ID_BYTES]),
        signature=data[2 + _ID_BYTES :],
        trusted_comment=lines[2].removeprefix(_TRUSTED),
        comment_signature=_decoded(lines[3], where, "minisign signature"),
    )


def verify(data: bytes, signature: FileSignature, key: SigningPublicKey, where: str) -> None:
    """Refuse data, or a trusted comment, that the key has not signed.

    Raises:
        SignatureRefused: it has not.
    """
    public = Ed25519PublicKey.from_public_bytes(key.point)
    comment = signature.signature + signature.trusted_comment.encode()
    try:
        public.verify(signature.signature, hashlib.blake2b(data).digest())
        public.verify(signature.comment_signature, comment)
    except InvalidSignature as error:
        raise SignatureRefused(
            f"{where}: the signature by key {key.key_id} does not fit: file, comment or signature "
            "was changed since; get both files again from where they were published"
        ) from error


def _blob(text: str, where: str, what: str, size: int) -> bytes:
    lines = text.splitlines()
    if len(lines) < 2 or not lines[0].startswith(_UNTRUSTED):
        raise SignatureRefused(f"{where}: expected a {what}, whose first line is a comment")
    data = _decoded(lines[1], where, what)
    if len(data) != size:
        raise SignatureRefused(f"{where}: expected a {what} of {size} bytes, got {len(data)}")
    return data


def _decoded(line: str, where: str, what: str) -> bytes:
    try:
        return base64.b64decode(line.encode(), validate=True)
    except (binascii.Error, ValueError) as error:
        raise SignatureRefused(f"{where}: expected a {what} in base64: {error}") from error


def _coded(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _shown(id_bytes: bytes) -> str:
    """Return a key's id as minisign prints it: the number, its lowest byte last."""
    return id_bytes[::-1].hex().upper()
