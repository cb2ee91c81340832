"""Inject faults into a twin and take them away again, on simulated time."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

from drivers.clock import NS_PER_S
from sim_twin.errors import FaultRefused
from sim_twin.faults.effect import Ending, FaultParameter, Target
from sim_twin.faults.request import FaultRequest, instances_of, parse_request
from sim_twin.faults.table import EFFECTS, faults_of
from sim_twin.faults.vocabulary import Component, Fault

if TYPE_CHECKING:
    from sim_twin.twin import Twin


class FaultHandle:
    """Follow one injected fault."""

    def __init__(self, number: int, request: FaultRequest, twin: Twin) -> None:
        self.number = number
        self.request = request
        self._twin = twin
        self._injected_ns = twin.now_ns
        self._ending: Ending | None = None
        self._cleared = False

    @property
    def is_on(self) -> bool:
        """Return whether the fault is in force now."""
        return self._ending is not None

    @property
    def is_over(self) -> bool:
        """Return whether the fault will not come back."""
        return self._cleared or self.request.timing.is_over(self._elapsed_s())

    def clear(self) -> None:
        """End the fault for good; clearing twice is allowed."""
        self._cleared = True
        self.follow()

    def follow(self) -> None:
        """Begin or end the fault as its timing says."""
        wanted = not self._cleared and self.request.timing.is_on(self._elapsed_s())
        if wanted and self._ending is None:
            self._ending = self.request.effect.begin(self._target())
        elif not wanted and self._ending is not None:
            ending, self._ending = self._ending, None
            ending()

    def _elapsed_s(self) -> float:
        return (self._twin.now_ns - self._injected_ns) / NS_PER_S

    def _target(self) -> Target:
        request = self.request
        return Target(
            twin=self._twin,
            number=request.number,
            values=request.values,
            seed=request.timing.seed,
        )

    def describe(self) -> dict[str, Any]:
        """Return what is known of the fault, for printing."""
        return {"id": self.number, "fault": self.request.label, "on": self.is_on}


class FaultInjector:
    """Own the faults of one twin; `step` runs with every step of the physics."""

    def __init__(self, twin: Twin) -> None:
        self._twin = twin
        self._numbers = itertools.count(1)
        self._handles: list[FaultHandle] = []

    @property
    def pending(self) -> tuple[FaultHandle, ...]:
        """Return the faults that are on or may still come."""
        return tuple(self._handles)

    def inject(
        self,
        component: str | Component,
        instance: str | int | None,
        fault: str | Fault,
        **details: Any,
    ) -> FaultHandle:
        """Add a fault: `start_s`, `duration_s` and `seed`, and the effect's own parameters.

        An intermittent fault names another one by `of`, and its rhythm by `period_s` with
        `duty_ratio` or `probability`.

        Raises:
            FaultRefused: the combination is not supported, a value is out of range, or the same
                fault is there already.
        """
        words = {"component": component, "instance": instance, "fault": fault}
        return self.inject_checked(parse_request({**details, **words}, self._twin.robot))

    def inject_checked(self, request: FaultRequest) -> FaultHandle:
        """Add a fault that was checked before.

        Raises:
            FaultRefused: the same fault is there already.
        """
        for handle in self._handles:
            if _cause(handle.request) == _cause(request):
                raise FaultRefused(
                    f"{request.label}: is there already as fault {handle.number}; clear it first"
                )
        handle = FaultHandle(next(self._numbers), request, self._twin)
        self._handles.append(handle)
        handle.follow()
        return handle

    def clear(self, number: int) -> None:
        """End one fault.

        Raises:
            FaultRefused: there is no such fault.
        """
        for handle in self._handles:
            if handle.number == number:
                handle.clear()
                self._handles.remove(handle)
                return
        known = ", ".join(str(handle.number) for handle in self._handles) or "none"
        raise FaultRefused(f"there is no fault {number}; in force or to come: {known}")

    def clear_all(self) -> None:
        """End every fault."""
        while self._handles:
            self._handles.pop().clear()

    def step(self) -> None:
        """Let faults come and go as their timing says."""
        if not self._handles:
            return
        for handle in self._handles:
            handle.follow()
        self._handles = [handle for handle in self._handles if not handle.is_over]

    def catalogue(self) -> list[dict[str, Any]]:
        """Return every supported combination with its parameters and instances."""
        return [
            {
                "component": component.value,
                "instances": instances_of(component, self._twin.robot),
                "faults": [
                    _described(component, fault)
                    for fault in faults_of(component)
                    if fault is not Fault.INTERMITTENT
                ],
            }
            for component in Component
        ]


def _cause(request: FaultRequest) -> tuple[Component, int, Fault]:
    return request.component, request.number, request.of or request.fault


def _described(component: Component, fault: Fault) -> dict[str, Any]:
    effect = EFFECTS[component, fault]
    return {
        "fault": fault.value,
        "summary": effect.summary,
        "parameters": [_parameter(each) for each in effect.parameters],
    }


def _parameter(parameter: FaultParameter) -> dict[str, Any]:
    return {
        "name": parameter.name,
        "default": parameter.default,
        "range": [parameter.low, parameter.high],
        "meaning": parameter.meaning,
    }
