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
from typing import Any

import numpy as np

from vla_deploy.ipc.errors import BadPayload

_INT = struct.Struct("<q")
_FLOAT = struct.Struct("<d")
_COUNT = struct.Struct("<I")


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
    """Number the types of one stream."""

    def __init__(self, known: Sequence[type]) -> None:
        self.types = tuple(known)
        self._codes = {kind: bytes((code,)) for code, kind in enumerate(known)}
        self._fields = {
            kind: tuple(field.name for field in dataclasses.fields(kind))
            for kind in known
            if dataclasses.is_dataclass(kind)
        }

    def document(self) -> list[list[Any]]:
        """Return names and fields, as the stream carries them."""
        return [[kind.__name__, *self._fields.get(kind, ())] for kind in self.types]

    def pack(self, value: object) -> bytes:
        """Return the bytes of one value.

        Raises:
            BadPayload: a type that is neither plain nor in the catalogue.
        """
        out = bytearray()
        self.put(out, value)
        return bytes(out)

    def put(self, out: bytearray, value: Any) -> None:
        """Append the bytes of one value.

        Raises:
            BadPayload: a type that is neither plain nor in the catalogue.
        """
        kind = type(value)
        put = _PLAIN.get(kind)
        if put is not None:
            put(out, value)
        elif kind is tuple:
            self._put_many(out, b"(", value)
        elif kind is frozenset:
            self._put_many(out, b"{", sorted(value, key=self.pack))
        elif kind in self._fields:
            out += b"@" + self._codes[kind]
            for name in self._fields[kind]:
                self.put(out, getattr(value, name))
        elif kind in self._codes:
            out += b"E" + self._codes[kind]
            _put_text(out, value.name)
        else:
            raise BadPayload(
                f"cannot pack a {kind.__name__}; expected None, bool, int, float, str, bytes, "
                f"tuple, frozenset, array, or one of {[known.__name__ for known in self.types]}"
            )

    def _put_many(self, out: bytearray, tag: bytes, values: Sequence[Any]) -> None:
        out += tag + _COUNT.pack(len(values))
        for value in values:
            self.put(out, value)


def _put_text(out: bytearray, value: str) -> None:
    _put_bytes(out, value.encode(), b"s")


def _put_bytes(out: bytearray, value: bytes, tag: bytes = b"b") -> None:
    out += tag + _COUNT.pack(len(value)) + value


def _put_array(out: bytearray, value: "np.ndarray[Any, Any]") -> None:
    out += array_head(value.dtype.str, value.shape)
    out += value.tobytes()


_heads: dict[tuple[str, tuple[int, ...]], bytes] = {}


def array_head(code: str, shape: tuple[int, ...]) -> bytes:
    """Return what stands before an array's bytes."""
    head = _heads.get((code, shape))
    if head is None:
        name = code.encode()
        sizes = b"".join(map(_COUNT.pack, shape))
        head = b"A" + bytes((len(name),)) + name + bytes((len(shape),)) + sizes
        _heads[code, shape] = head
    return head


_PLAIN: dict[type, Callable[[bytearray, Any], None]] = {
    type(None): lambda out, _: out.extend(b"N"),
    bool: lambda out, value: out.extend(b"T" if value else b"F"),
    int: lambda out, value: out.extend(b"i" + _INT.pack(value)),
    float: lambda out, value: out.extend(b"d" + _FLOAT.pack(value)),
    str: _put_text,
    bytes: _put_bytes,
    np.ndarray: _put_array,
    **dict.fromkeys((np.float64, np.float32, np.bool_, np.int64, np.uint8), _put_array),
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
            f"a default that are missing {missing}; judge it with the version that recorded it"
        )
    return kind, tuple(fields)
