import math
import struct
from dataclasses import dataclass
from enum import Enum, IntEnum

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from vla_deploy.ipc import BadPayload
from vla_deploy.ipc.memory.packing import Catalogue, Unpacker, types_within


class Colour(Enum):
    RED = "red"


class Rank(IntEnum):
    LOW = 1


@dataclass(frozen=True, kw_only=True)
class Inner:
    colour: Colour
    value: float | None


@dataclass(frozen=True, kw_only=True)
class Outer:
    parts: tuple[Inner, ...]
    ranks: frozenset[Rank]
    name: str = ""


CATALOGUE = Catalogue(types_within(Outer))


def unpacked(data, document=None, known=CATALOGUE.types):
    unpacker = Unpacker(document or CATALOGUE.document(), known)
    unpacker.load(data)
    value = unpacker.take()
    assert unpacker.at == len(data)
    return value


def test_every_type_within_a_dataclass_is_found_by_annotation():
    assert set(types_within(Outer)) == {Outer, Inner, Colour, Rank}


plain = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**63 - 1)
    | st.text()
    | st.binary()
    | st.floats(allow_nan=False)
    | st.builds(Inner, colour=st.sampled_from(Colour), value=st.none() | st.floats(0, 1)),
    lambda inner: st.tuples(inner, inner) | st.frozensets(st.integers(0, 9)).map(frozenset),
)


@given(plain)
def test_what_is_packed_comes_back_equal_and_of_the_same_type(value):
    back = unpacked(CATALOGUE.pack(value))
    assert back == value
    assert type(back) is type(value)
    assert CATALOGUE.pack(back) == CATALOGUE.pack(value)  # tags tell 1 from True and 1.0


@given(st.lists(st.builds(Inner, colour=st.sampled_from(Colour), value=plain), max_size=9))
def test_a_catalogue_that_remembers_packs_as_one_that_does_not(values):
    for value in values:
        assert CATALOGUE.pack(value) == Catalogue(CATALOGUE.types).pack(value)


def test_an_array_in_a_field_is_looked_into_each_time():
    array = np.zeros(2)
    value = Inner(colour=Colour.RED, value=array)  # type: ignore[arg-type]
    before = CATALOGUE.pack(value)
    array[0] = 1.0
    assert CATALOGUE.pack(value) != before


@given(st.integers(0, 2**64 - 1))
def test_every_float_keeps_its_bits_also_as_nan(bits):
    value = struct.unpack("<d", struct.pack("<Q", bits))[0]
    back = unpacked(CATALOGUE.pack(value))
    if math.isnan(value):
        assert math.isnan(back)
    assert CATALOGUE.pack(back) == CATALOGUE.pack(value)


@given(hnp.arrays(st.sampled_from(["f8", "f4", "u1", "?", "i8"]), hnp.array_shapes(min_side=0)))
def test_every_array_keeps_its_bits_type_and_shape(array):
    back = unpacked(CATALOGUE.pack(array))
    assert (back.dtype, back.shape, back.tobytes()) == (array.dtype, array.shape, array.tobytes())


def test_a_numpy_number_stays_one():
    assert type(unpacked(CATALOGUE.pack(np.float64(0.5)))) is np.float64


def test_a_type_that_is_not_in_the_catalogue_is_refused_by_name():
    with pytest.raises(BadPayload, match="cannot pack a dict; expected None"):
        CATALOGUE.pack({})


def test_a_field_that_came_later_takes_its_default():
    document = [["Outer", "ranks", "parts"], *CATALOGUE.document()[1:]]
    old = Catalogue(CATALOGUE.types)
    data = old.pack(Outer(parts=(), ranks=frozenset({Rank.LOW})))
    without_name = data[:2] + data[7:-5] + data[2:7]  # ranks first, no name
    assert unpacked(without_name, document) == Outer(parts=(), ranks=frozenset({Rank.LOW}))


def test_a_field_that_is_gone_or_has_no_default_is_named():
    document = [["Outer", "parts", "nose"], *CATALOGUE.document()[1:]]
    with pytest.raises(BadPayload, match=r"unknown fields \['nose'\].* missing \['ranks'\]"):
        Unpacker(document, CATALOGUE.types)


def test_a_type_that_is_gone_is_named():
    with pytest.raises(BadPayload, match="type Gone is unknown to this version"):
        Unpacker([["Gone", "a"]], CATALOGUE.types)


@given(st.binary(max_size=60))
def test_spoiled_bytes_are_refused_and_never_crash(data):
    unpacker = Unpacker(CATALOGUE.document(), CATALOGUE.types)
    unpacker.load(data)
    try:
        unpacker.take()
    except BadPayload as error:
        assert "packed value at byte" in str(error)
