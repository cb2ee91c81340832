"""Turn passwords into what may be stored, and judge them by it."""

import hashlib
import hmac
import re
import secrets
import threading
from base64 import b64decode, b64encode
from typing import Final

SHORTEST: Final = 12
LONGEST: Final = 256
# 16 MiB and a quarter of a second on a small board: OWASP's row for little memory.
_LOG2_COST: Final = 14
_BLOCK: Final = 8
_PARALLEL: Final = 5
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


def generated() -> str:
    """Return a password of 100 random bits that a person can read out and type."""
    groups = (
        "".join(secrets.choice(_LETTERS) for _ in range(_GROUP_LETTERS)) for _ in range(_GROUPS)
    )
    return "-".join(groups)


def stored_form(password: str) -> str:
    """Return what is stored of a password: cost, salt and key, from which it cannot be found."""
    salt = secrets.token_bytes(_SALT_BYTES)
    key = _key(password, salt, _LOG2_COST, _BLOCK, _PARALLEL)
    words = (str(_LOG2_COST), str(_BLOCK), str(_PARALLEL), _text(salt), _text(key))
    return "$".join(("scrypt", *words))


def fits(password: str, stored: str) -> bool:
    """Tell whether a password is the one of a stored form; takes a quarter of a second."""
    parts = _parts(stored)
    if parts is None:
        return False
    log2_cost, block, parallel, salt, key = parts
    return hmac.compare_digest(_key(password, salt, log2_cost, block, parallel), key)


def is_stored_form(text: str) -> bool:
    """Tell whether a text is like what `stored_form` returns, and may be computed here."""
    return _parts(text) is not None


def _parts(text: str) -> tuple[int, int, int, bytes, bytes] | None:
    found = _STORED.fullmatch(text)
    if found is None:
        return None
    log2_cost, block, parallel = (int(found[number]) for number in (1, 2, 3))
    try:
        salt, key = b64decode(found[4], validate=True), b64decode(found[5], validate=True)
    except ValueError:  # letters of that alphabet, but not so many
        return None
    is_small = 128 * block * (2**log2_cost + parallel + 2) < _MOST_BYTES
    is_whole = len(key) == _KEY_BYTES and len(salt) >= _SALT_BYTES
    return (log2_cost, block, parallel, salt, key) if is_small and is_whole else None


def _key(password: str, salt: bytes, log2_cost: int, block: int, parallel: int) -> bytes:
    with _one_at_a_time:  # many logins at once take time, not memory
        return hashlib.scrypt(
            password.encode(errors="surrogatepass"),
            salt=salt,
            n=2**log2_cost,
            r=block,
            p=parallel,
            maxmem=_MOST_BYTES,
            dklen=_KEY_BYTES,
        )


def _text(data: bytes) -> str:
    return b64encode(data).decode()
