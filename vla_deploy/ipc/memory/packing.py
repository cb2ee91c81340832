"""Pack values into bytes and back, exact to the bit: what dataclasses of plain values hold.

A packed value is one tag byte and what follows it. Dataclasses and enumerations are named by their
place in a `Catalogue`, which is written down once per stream: fields go by name, so that bytes
outlive a reordering and a new field that has a default.
"""

import dataclasses
import struct
import typing
from collections.abc import Callable, Sequence
from enum import Enum
from functools import partial
from operator import attrgetter
from typing import Any, Final

import numpy as np

from vla_deploy.ipc.errors import BadPayload

_INT = struct.Struct("<q")
_FLOAT = struct.Struct("<d")
_int = struct.Struct("<cq").pack
_float = struct.Struct("<cd").pack
_COUNT = struct.Struct("<I")
_NOTHING: Final = object()


def types_within(*roots: type) -> tuple[type, ...]:
    """Return every dataclass and enumeration that values of `roots` may hold, by annotation."""
    found: dict[type, None] = {}
    waiting: list[Any] = list(roots)
    while waiting:
        hint = waiting.pop(0)
        waiting += typing.get_args(hint)
        if not isinstance(hint, type) or hint in found:
            continue
        if dataclasses.is_dataclass(hint):
            found[hint] = None
            waiting += typing.get_type_hints(hint).values()
        elif issubclass(hint, Enum):
            found[hint] = None
    return tuple(found)


class Catalogue:
    """Number the types of one stream, and pack their values.

    What a dataclass' field held last time is remembered with its bytes, and the same object is
    taken for unchanged; bare arrays are looked into each time.
    """

    def __init__(self, known: Sequence[type]) -> None:
        self.types = tuple(known)
        self._rows: dict[type, _Row] = {}
        self._members: dict[type, dict[Enum, bytes]] = {}
        for code, kind in enumerate(known):
            if dataclasses.is_dataclass(kind):
                self._rows[kind] = _Row(code, tuple(one.name for one in dataclasses.fields(kind)))
            elif issubclass(kind, Enum):
                head = b"E" + bytes((code,))
                self._members[kind] = {one: head + _text(one.name) for one in kind}

    def document(self) -> list[list[Any]]:
        """Return names and fields, as the stream carries them."""
        return [
            [kind.__name__, *(self._rows[kind].names if kind in self._rows else ())]
            for kind in self.types
        ]

    def pack(self, value: Any) -> bytes:
        """Return the bytes of one value.

        Raises:
            BadPayload: a type that is neither plain nor in the catalogue.
        """
        kind = type(value)
        plain = _PLAIN.get(kind)
        if plain is not None:
            return plain(value)
        if kind in self._rows:
            return self._rows[kind].pack(value, self.pack)
        if kind is tuple:
            return _many(b"(", [self.pack(one) for one in value])
        if kind is frozenset:
            return _many(b"{", sorted(map(self.pack, value)))
        if kind in self._members:
            return self._members[kind][value]
        raise BadPayload(
            f"cannot pack a {kind.__name__}; expected None, bool, int, float, str, bytes, "
            f"tuple, frozenset, array, or one of {[known.__name__ for known in self.types]}"
        )


class _Row:
    """Pack the fields of one dataclass; most are what they were."""

    def __init__(self, code: int, names: tuple[str, ...]) -> None:
        self.names = names
        self._head = b"@" + bytes((code,))
        self._read: Callable[[Any], tuple[Any, ...]] = (
            attrgetter(*names)
            if len(names) > 1
            else lambda value: tuple(getattr(value, name) for name in names)
        )
        self._values: tuple[Any, ...] = (_NOTHING,) * len(names)
        self._packed = [b""] * len(names)

    def pack(self, value: Any, pack: Callable[[Any], bytes]) -> bytes:
        # A plain loop, not a comprehension with a call: control does this each tick.
        values = self._read(value)
        packed = [self._head]
        append = packed.append
        for new, old, known in zip(values, self._values, self._packed, strict=True):
            kind = type(new)
            if kind is float:
                append(_float(b"d", new))
            elif new is old and kind is not np.ndarray:
                append(known)
            else:
                append(pack(new))
        self._values, self._packed = values, packed[1:]
        return b"".join(packed)


def _many(tag: bytes, packed: Sequence[bytes]) -> bytes:
    return tag + _COUNT.pack(len(packed)) + b"".join(packed)


def _text(value: str) -> bytes:
    return _bytes(value.encode(), b"s")


def _bytes(value: bytes, tag: bytes = b"b") -> bytes:
    return tag + _COUNT.pack(len(value)) + value


def _array(value: "np.ndarray[Any, Any]") -> bytes:
    key = (value.dtype, value.shape)
    head = _heads.get(key)
    if head is None:
        head = _heads[key] = _array_head(*key)
    return head + value.tobytes()


_heads: dict[tuple[Any, tuple[int, ...]], bytes] = {}


def _array_head(dtype: "np.dtype[Any]", shape: tuple[int, ...]) -> bytes:
    name = dtype.str.encode()
    sizes = b"".join(map(_COUNT.pack, shape))
    return b"A" + bytes((len(name),)) + name + bytes((len(shape),)) + sizes


_PLAIN: dict[type, Callable[[Any], bytes]] = {
    type(None): lambda _: b"N",
    bool: lambda value: b"T" if value else b"F",
    int: partial(_int, b"i"),
    float: partial(_float, b"d"),
    str: _text,
    bytes: _bytes,
    np.ndarray: _array,
    **dict.fromkeys((np.float64, np.float32, np.bool_, np.int64, np.uint8), _array),
}


class Unpacker:
    """Take values from bytes that were packed with the catalogue of `document`.

    Raises:
        BadPayload: the document names a type or a field that is unknown by now, or lacks one that
            has no default.
    """

    def __init__(self, document: Sequence[Sequence[str]], known: Sequence[type]) -> None:
        by_name = {kind.__name__: kind for kind in known}
        self._rows = [_check(name, fields, by_name) for name, *fields in document]
        self._take: dict[int, Callable[[], Any]] = {
            ord("N"): lambda: None,
            ord("T"): lambda: True,
            ord("F"): lambda: False,
            ord("i"): lambda: self._struct(_INT),
            ord("d"): lambda: self._struct(_FLOAT),
            ord("s"): lambda: self._bytes(self._struct(_COUNT)).decode(),
            ord("b"): lambda: self._bytes(self._struct(_COUNT)),
            ord("A"): self._array,
            ord("("): lambda: tuple(self.take() for _ in range(self._struct(_COUNT))),
            ord("{"): lambda: frozenset(self.take() for _ in range(self._struct(_COUNT))),
            ord("@"): self._dataclass,
            ord("E"): self._member,
        }
        self._data = b""
        self.at = 0

    def load(self, data: bytes, at: int = 0) -> None:
        """Begin to take from `data`."""
        self._data = data
        self.at = at

    def take(self) -> Any:
        """Return the next value.

        Raises:
            BadPayload: the bytes are not what was packed.
        """
        try:
            return self._take[self._bytes(1)[0]]()
        except (KeyError, IndexError, struct.error, ValueError, TypeError) as error:
            raise BadPayload(f"packed value at byte {self.at}: cannot read it: {error}") from error

    def _bytes(self, count: int) -> bytes:
        taken = self._data[self.at : self.at + count]
        if len(taken) != count:
            raise ValueError(f"{count} bytes expected, {len(taken)} there")
        self.at += count
        return taken

    def _struct(self, form: struct.Struct) -> Any:
        return form.unpack(self._bytes(form.size))[0]

    def _array(self) -> Any:
        dtype = np.dtype(self._bytes(self._bytes(1)[0]).decode())
        shape = tuple(self._struct(_COUNT) for _ in range(self._bytes(1)[0]))
        count = int(np.prod(shape, dtype=np.int64)) * dtype.itemsize
        array = np.frombuffer(self._bytes(count), dtype).reshape(shape)
        return array if shape else array[()]

    def _dataclass(self) -> Any:
        kind, fields = self._rows[self._bytes(1)[0]]
        return kind(**{name: self.take() for name in fields})

    def _member(self) -> Any:
        kind, _ = self._rows[self._bytes(1)[0]]
        return kind[self.take()]  # type: ignore[index]


def _check(
    name: str, fields: Sequence[str], known: dict[str, type]
) -> tuple[type, tuple[str, ...]]:
    kind = known.get(name)
    if kind is None:
        raise BadPayload(f"recorded type {name} is unknown to this version; it has {list(known)}")
    if not dataclasses.is_dataclass(kind):
        return kind, ()
    declared = {field.name: field for field in dataclasses.fields(kind)}
    needed = {
        field.name
        for field in declared.values()
        if field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
    }
    unknown, missing = sorted(set(fields) - set(declared)), sorted(needed - set(fields))
    if unknown or missing:
        raise BadPayload(
            f"recorded {name} does not fit this version: unknown fields {unknown}, fields without "
            f"a default that are missing {missing}"
        )
    return kind, tuple(fields)
