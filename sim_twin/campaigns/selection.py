"""Choose the cases whose name contains a text; a text that no name contains is a mistake."""

from collections.abc import Callable, Iterable
from typing import Final, TypeVar

_SHOWN: Final = 6
T = TypeVar("T")


class OptionRefused(Exception):
    """Say why an option cannot be met."""


class NothingChosen(OptionRefused):
    """Say that no case has such a name, and which names there are."""


def chosen(cases: Iterable[T], only: str, name_of: Callable[[T], str]) -> list[T]:
    """Return the cases whose name contains `only`; all where it is empty.

    Raises:
        NothingChosen: there are cases, but none of such a name.
    """
    all_of_them = list(cases)
    found = [case for case in all_of_them if only in name_of(case)]
    if all_of_them and not found:
        names = ", ".join(name_of(case) for case in all_of_them[:_SHOWN])
        more = ", ..." if len(all_of_them) > _SHOWN else ""
        raise NothingChosen(
            f"--only {only}: expected a part of a case's name, of which there are "
            f"{len(all_of_them)}: {names}{more}"
        )
    return found
