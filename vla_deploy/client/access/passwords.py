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
_LETTERS: Final = "abcdefghijkmnpqrstuvwxyz23456789"  # none that is read as another
_GROUPS: Final = 5
_GROUP_LETTERS: Final = 4
_one_at_a_time = threading.Lock()


@dataclass(frozen=True, slots=True, kw_only=True)
class Cost:
    """Say what trying a password costs: 2 to the power of `log2_rounds`, blocks, repetitions.

    The default is OWASP's for little memory: 16 MiB and a quarter of a second on a small board.
    """

    log2_rounds: int = 14
    block: int = 8
    parallel: int = 5


DEFAULT_COST: Final = Cost()


def generated() -> str:
    """Return a password of 100 random bits that a person can read out and type."""
    groups = (
        "".join(secrets.choice(_LETTERS) for _ in range(_GROUP_LETTERS)) for _ in range(_GROUPS)
    )
    return "-".join(groups)


def stored_form(password: str, cost: Cost = DEFAULT_COST) -> str:
    """Return what is stored of a password: cost, salt and key, from which it cannot be found."""
    salt = secrets.token_bytes(_SALT_BYTES)
    return _written(cost, salt, _key(password, salt, cost))


def nobodys(cost: Cost = DEFAULT_COST) -> str:
    """Return the stored form of a password that nobody knows."""
    return _written(cost, secrets.token_bytes(_SALT_BYTES), secrets.token_bytes(_KEY_BYTES))


def fits(password: str, stored: str) -> bool:
    """Tell whether a password is the one of a stored form; takes a quarter of a second."""
    parts = _parts(stored)
    if parts is None:
        return False
    cost, salt, key = parts
    return hmac.compare_digest(_key(password, salt, cost), key)


def is_stored_form(text: str) -> bool:
    """Tell whether a text is like what `stored_form` returns, and may be computed here."""
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
    except ValueError:  # letters of that alphabet, but not so many
        return None
    is_small = 128 * block * (2**log2_rounds + parallel + 2) < _MOST_BYTES
    is_whole = len(key) == _KEY_BYTES and len(salt) >= _SALT_BYTES
    cost = Cost(log2_rounds=log2_rounds, block=block, parallel=parallel)
    return (cost, salt, key) if is_small and is_whole else None


def _key(password: str, salt: bytes, cost: Cost) -> bytes:
    with _one_at_a_time:  # many logins at once take time, not memory
        return hashlib.scrypt(
            password.encode(errors="surrogatepass"),
            salt=salt,
            n=2**cost.log2_rounds,
            r=cost.block,
            p=cost.parallel,
            maxmem=_MOST_BYTES,
            dklen=_KEY_BYTES,
        )
