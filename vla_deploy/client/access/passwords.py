"""Hash passwords with scrypt, and compare passwords with the hash."""

import hashlib
import hmac
import re
import secrets
import threading
from base64 import b64decode, b64encode
from dataclasses import dataclass
from typing import Final

SHORTEST: Final = 12
LONGEST: Final = 256
_SALT_BYTES: Final = 16
_KEY_BYTES: Final = 32
_MOST_BYTES: Final = 64 * 2**20
_STORED: Final = re.compile(
    r"scrypt\$(1[0-7])\$([1-9]|1[0-6])\$([1-9]|1[0-6])\$([A-Za-z0-9+/=]+)\$([A-Za-z0-9+/=]+)"
)
_LETTERS: Final = "abcdefghijkmnpqrstuvwxyz23456789"  # without look-alikes
_GROUPS: Final = 5
_GROUP_LETTERS: Final = 4
_one_at_a_time = threading.Lock()


@dataclass(frozen=True, slots=True, kw_only=True)
class Cost:
    """Set the cost of one password hash: log2 of scrypt's N, its r and its p.

    The default is OWASP's for little memory: 16 MiB and a quarter of a second on a small board.
    """

    log2_rounds: int = 14
    block: int = 8
    parallel: int = 5


DEFAULT_COST: Final = Cost()


def generate_password() -> str:
    """Return a password of 100 random bits that a person can read out and type."""
    groups = (
        "".join(secrets.choice(_LETTERS) for _ in range(_GROUP_LETTERS)) for _ in range(_GROUPS)
    )
    return "-".join(groups)


def hash_password(password: str, cost: Cost = DEFAULT_COST) -> str:
    """Return the hash of a password: cost, salt and key as text."""
    salt = secrets.token_bytes(_SALT_BYTES)
    return _written(cost, salt, _key(password, salt, cost))


def unmatchable_hash(cost: Cost = DEFAULT_COST) -> str:
    """Return a hash that no password matches, at the same cost."""
    return _written(cost, secrets.token_bytes(_SALT_BYTES), secrets.token_bytes(_KEY_BYTES))


def matches(password: str, stored: str) -> bool:
    """Return whether a password has this hash; takes a quarter of a second."""
    parts = _parts(stored)
    if parts is None:
        return False
    cost, salt, key = parts
    return hmac.compare_digest(_key(password, salt, cost), key)


def is_password_hash(text: str) -> bool:
    """Return whether a text is a hash of `hash_password` at an acceptable cost."""
    return _parts(text) is not None


def _written(cost: Cost, salt: bytes, key: bytes) -> str:
    numbers = (str(cost.log2_rounds), str(cost.block), str(cost.parallel))
    return "$".join(("scrypt", *numbers, b64encode(salt).decode(), b64encode(key).decode()))


def _parts(text: str) -> tuple[Cost, bytes, bytes] | None:
    found = _STORED.fullmatch(text)
    if found is None:
        return None
    log2_rounds, block, parallel = (int(found[number]) for number in (1, 2, 3))
    try:
        salt, key = b64decode(found[4], validate=True), b64decode(found[5], validate=True)
    except ValueError:  # the right alphabet, the wrong length
        return None
    is_small = 128 * block * (2**log2_rounds + parallel + 2) < _MOST_BYTES
    is_whole = len(key) == _KEY_BYTES and len(salt) >= _SALT_BYTES
    cost = Cost(log2_rounds=log2_rounds, block=block, parallel=parallel)
    return (cost, salt, key) if is_small and is_whole else None


def _key(password: str, salt: bytes, cost: Cost) -> bytes:
    with _one_at_a_time:  # parallel logins take time, not memory
        return hashlib.scrypt(
            password.encode(errors="surrogatepass"),
            salt=salt,
            n=2**cost.log2_rounds,
            r=cost.block,
            p=cost.parallel,
            maxmem=_MOST_BYTES,
            dklen=_KEY_BYTES,
        )
