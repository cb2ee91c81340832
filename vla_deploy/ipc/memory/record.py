"""Keep the scratch record that a cell's packed fields are filled into."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vla_deploy.ipc.errors import BadPayload
from vla_deploy.ipc.memory.layout import record_dtype
from vla_deploy.ipc.topics import Topic


class Scratch:
    """Hold one record of a topic, its columns as views and its bytes, allocated once."""

    def __init__(self, topic: Topic[Any]) -> None:
        array = np.zeros(1, record_dtype(topic))
        self.record: np.void = array[0]
        self.payload = array.view(np.uint8).data
        self._topic = topic
        self._columns: dict[str, NDArray[Any]] = {
            field.name: array[field.name].reshape(field.shape) for field in topic.fields
        }
        self._may_lack = {field.name: 0 for field in topic.fields if field.may_lack}

    def fill(self, fields: Mapping[str, Any]) -> None:
        """Set every field; what is not given of one that may lack, and of an array, is zero.

        Raises:
            BadPayload: a field is missing, unknown, or does not fit its declaration.
        """
        if fields.keys() != self._columns.keys():
            fields = {**self._may_lack, **fields}
        if fields.keys() != self._columns.keys():
            missing = sorted(self._columns.keys() - fields.keys())
            unknown = sorted(fields.keys() - self._columns.keys())
            raise BadPayload(f"topic {self._topic.name}: missing {missing}, unknown {unknown}")
        for name, column in self._columns.items():
            try:
                _assign(column, fields[name])
            except (TypeError, ValueError, OverflowError) as error:
                expected = f"expected {column.dtype} x {column.size}"
                where = f"topic {self._topic.name}, field {name}"
                raise BadPayload(f"{where}: {expected}: {error}") from error


def _assign(column: NDArray[Any], value: Any) -> None:
    if column.size == 1:
        column[0] = value
        return
    count = len(value)
    if count == column.size:
        column[:] = value
        return
    if count > column.size:
        raise ValueError(f"got {count} values")
    column[:count] = value
    column[count:] = 0
