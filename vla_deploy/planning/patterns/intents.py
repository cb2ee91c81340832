"""Name what a command is for; what is urgent comes first where the order is free."""

from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType
from typing import Final

from vla_deploy.planning.plan import Priority


class Intent(StrEnum):
    """Group commands by what they are for."""

    STOP = "stop"
    ASSIST = "assist"
    NAVIGATION = "navigation"
    MANIPULATION = "manipulation"
    SEARCH = "search"
    QUESTION = "question"
    CLEANING = "cleaning"


PRIORITIES: Final[Mapping[Intent, Priority]] = MappingProxyType(
    {
        Intent.STOP: Priority.HIGH,
        Intent.ASSIST: Priority.HIGH,
        Intent.NAVIGATION: Priority.MEDIUM,
        Intent.MANIPULATION: Priority.MEDIUM,
        Intent.SEARCH: Priority.MEDIUM,
        Intent.QUESTION: Priority.MEDIUM,
        Intent.CLEANING: Priority.LOW,
    }
)
