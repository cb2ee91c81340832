"""Show in the graph which parameters hold; none of them changes while the robot runs."""

from collections.abc import Mapping
from typing import Any, Final

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from vla_deploy.gateways.ros.parameters import PARAMETERS, RosParameter

_TYPES: Final[Mapping[type, Parameter.Type]] = {
    bool: Parameter.Type.BOOL,
    float: Parameter.Type.DOUBLE,
    int: Parameter.Type.INTEGER,
    list: Parameter.Type.STRING_ARRAY,
    str: Parameter.Type.STRING,
}
_NAMES: Final = frozenset(one.name for one in PARAMETERS)
_HOW: Final = "set it in the parameter file and start again"


class SteadyNode(Node):  # type: ignore[misc]  # rclpy has no types
    """Be a node whose parameters, those of the table, are set before it starts."""

    def __init__(self, name: str, values: Mapping[str, Any], **options: Any) -> None:
        """Declare every parameter of the table that has a value."""
        declared = [(one, values[one.name]) for one in PARAMETERS if one.name in values]
        overrides = [_typed(one, value) for one, value in declared if value != []]
        super().__init__(name, parameter_overrides=overrides, **options)
        for one, value in declared:
            if value == []:
                self._declare_empty(one)
            else:
                kind = _TYPES[type(one.default)]
                self.declare_parameter(one.name, kind, _descriptor(one, value))

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Refuse in words what sets a parameter of the table."""
        refused = [one.name for one in parameter_list if one.name in _NAMES]
        if refused:
            reason = f"{', '.join(refused)}: read-only; {_HOW}"
            return SetParametersResult(successful=False, reason=reason)
        return super().set_parameters_atomically(parameter_list)

    def _declare_empty(self, parameter: RosParameter) -> None:
        """Declare an empty list: rclpy takes it for bytes unless it replaces a list of texts."""
        self.declare_parameter(parameter.name, [""])
        super().set_parameters_atomically([_typed(parameter, [])])
        self.set_descriptor(parameter.name, _descriptor(parameter, []))


def _typed(parameter: RosParameter, value: Any) -> Parameter:
    return Parameter(parameter.name, _TYPES[type(parameter.default)], value)


def _descriptor(parameter: RosParameter, value: Any) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(
        type=_TYPES[type(parameter.default)].value,
        description=parameter.description,
        read_only=True,
    )
    if parameter.choices:
        descriptor.additional_constraints = parameter.expected
    if parameter.low is not None and parameter.high is not None:
        # What a robot file has set may lie beyond the parameter's range.
        low, high = min(parameter.low, value), max(parameter.high, value)
        if isinstance(parameter.default, int):
            span = IntegerRange(from_value=int(low), to_value=int(high), step=1)
            descriptor.integer_range = [span]
        else:
            span = FloatingPointRange(from_value=float(low), to_value=float(high))
            descriptor.floating_point_range = [span]
    return descriptor
