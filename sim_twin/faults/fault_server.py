"""Answer what a fault's injector is asked over the twin's socket: list, inject, clear, run."""

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

from sim_twin.errors import FaultRefused
from sim_twin.faults.injector import FaultInjector
from sim_twin.faults.scenario import SCENARIOS, Scenario, parse_scenario, scenario_paths
from vla_deploy.robots import RobotDescription
from vla_deploy.runtime.table_schema import parse_toml

Answer = dict[str, Any]


class FaultServer:
    """Carry out requests on one injector; `operations` are by their names on the wire."""

    def __init__(self, injector: FaultInjector, robot: RobotDescription) -> None:
        self._injector = injector
        self._robot = robot
        self.operations: Mapping[str, Callable[[Mapping[str, Any]], Answer]] = {
            "fault_list": self._list,
            "fault_inject": self._inject,
            "fault_clear": self._clear,
            "fault_run": self._run,
        }

    def _list(self, _request: Mapping[str, Any]) -> Answer:
        return {
            "catalogue": self._injector.catalogue(),
            "scenarios": [path.stem for path in scenario_paths()],
            "pending": self._pending(),
        }

    def _inject(self, request: Mapping[str, Any]) -> Answer:
        details = {key: value for key, value in request.items() if key != "op"}
        words = [details.pop(key, None) for key in ("component", "instance", "fault")]
        return {"injected": self._injector.inject(*words, **details).describe()}

    def _clear(self, request: Mapping[str, Any]) -> Answer:
        number = request.get("id")
        if number is None:
            self._injector.clear_all()
        elif isinstance(number, int):
            self._injector.clear(number)
        else:
            raise FaultRefused(f"id: expected a fault's number, or none for all; got {number!r}")
        return {"pending": self._pending()}

    def _run(self, request: Mapping[str, Any]) -> Answer:
        scenario = self._scenario(str(request.get("name")), request.get("text"))
        for fault in scenario.faults:
            self._injector.inject_checked(fault)
        return {
            "scenario": scenario.name,
            "summary": scenario.summary,
            "meanwhile": scenario.meanwhile.value,
            "begin_s": scenario.begin_s,
            "end_s": scenario.end_s,
            "expect": asdict(scenario.expect),
            "pending": self._pending(),
        }

    def _scenario(self, name: str, text: object) -> Scenario:
        """Return the scenario of a given text, else the shipped one of that name."""
        if text is None:
            path = SCENARIOS / f"{name}.toml"
            if path not in scenario_paths():
                known = ", ".join(each.stem for each in scenario_paths())
                raise FaultRefused(f"no scenario {name!r} ships with the twin; there are {known}")
            text = path.read_text(encoding="utf-8")
        try:
            raw = parse_toml(str(text))
        except tomllib.TOMLDecodeError as error:
            raise FaultRefused(f"{name}: {error}") from error
        return parse_scenario(name, raw, self._robot)

    def _pending(self) -> list[Answer]:
        return [handle.describe() for handle in self._injector.pending]
