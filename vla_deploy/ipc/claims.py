"""Decide who may use which named resource: all of what was asked for, or nothing yet.

A holder asks once for all it needs, and who waits holds nothing, so nobody ever waits in a circle.
Those that wait are served by priority, then in the order they came; nobody overtakes one that waits
for the same resource.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from vla_deploy.ipc.errors import ClaimRefused


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """Ask for amounts of resources; a higher `priority` goes first, 0 in `expires_ns` is never."""

    holder: str
    wants: Mapping[str, int]
    priority: int = 0
    expires_ns: int = 0
    pid: int = 0
    pid_started: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Book:
    """Hold what there is, what is granted, and who waits in which order."""

    capacities: Mapping[str, int] = field(default_factory=dict)
    granted: tuple[Claim, ...] = ()
    waiting: tuple[Claim, ...] = ()

    def used(self, resource: str) -> int:
        """Return how much of a resource is granted."""
        return sum(claim.wants.get(resource, 0) for claim in self.granted)

    def holds(self, holder: str) -> bool:
        """Return whether a holder was granted what it asked for."""
        return any(claim.holder == holder for claim in self.granted)

    def waits(self, holder: str) -> bool:
        """Return whether a holder waits."""
        return any(claim.holder == holder for claim in self.waiting)


def ask(book: Book, claim: Claim, now_ns: int) -> Book:
    """Grant a claim, or let it wait.

    Raises:
        ClaimRefused: there is no such resource, never that much of it, or the holder has asked
            already.
    """
    if book.holds(claim.holder) or book.waits(claim.holder):
        raise ClaimRefused(
            f"{claim.holder} has asked already; release that first, then ask for all at once"
        )
    for resource, amount in claim.wants.items():
        _require(book, claim.holder, resource, amount)
    later = [one for one in book.waiting if one.priority < claim.priority]
    earlier = book.waiting[: len(book.waiting) - len(later)]
    return settle(replace(book, waiting=(*earlier, claim, *later)), now_ns)


def release(book: Book, holders: Iterable[str], now_ns: int) -> Book:
    """Take back what these holders have or wait for, and serve those that wait."""
    gone = frozenset(holders)
    return settle(
        replace(
            book,
            granted=tuple(one for one in book.granted if one.holder not in gone),
            waiting=tuple(one for one in book.waiting if one.holder not in gone),
        ),
        now_ns,
    )


def amend(book: Book, holder: str, wants: Mapping[str, int], now_ns: int) -> Book:
    """Correct what a holder was granted by what it turned out to take, be it more than there is."""
    granted = tuple(
        replace(one, wants=dict(wants)) if one.holder == holder else one for one in book.granted
    )
    return settle(replace(book, granted=granted), now_ns)


def widen(book: Book, holder: str, wants: Mapping[str, int]) -> Book:
    """Give a holder more, where that is free; who waits for it waits on, for it holds nothing.

    Whoever widens must hold something alone that nobody else who widens holds: two that each wait
    for what the other has would wait for ever.
    """
    own = next((one.wants for one in book.granted if one.holder == holder), None)
    if own is None:
        return book
    for resource, amount in wants.items():
        added = amount - own.get(resource, 0)
        if added > book.capacities.get(resource, 0) - book.used(resource):
            return book
    granted = tuple(
        replace(one, wants=dict(wants)) if one.holder == holder else one for one in book.granted
    )
    return replace(book, granted=granted)


def settle(book: Book, now_ns: int) -> Book:
    """Forget claims that have waited too long, and grant whatever can be granted."""
    granted = list(book.granted)
    waiting: list[Claim] = []
    free = {name: amount - book.used(name) for name, amount in book.capacities.items()}
    awaited: set[str] = set()
    for claim in book.waiting:
        if 0 < claim.expires_ns <= now_ns:
            continue
        fits = all(amount <= free.get(name, 0) for name, amount in claim.wants.items())
        if not fits or awaited & claim.wants.keys():
            waiting.append(claim)
            awaited |= claim.wants.keys()
            continue
        granted.append(claim)
        for name, amount in claim.wants.items():
            free[name] -= amount
    return replace(book, granted=tuple(granted), waiting=tuple(waiting))


def declare(book: Book, capacities: Mapping[str, int], now_ns: int) -> Book:
    """Say how much there is of some resources; what is granted stays granted."""
    return settle(replace(book, capacities={**book.capacities, **capacities}), now_ns)


def obstacles(book: Book, wants: Mapping[str, int]) -> str:
    """Say who holds what stands in the way of a wish, or who waits for it already."""
    told = []
    for resource, amount in wants.items():
        capacity = book.capacities.get(resource, 0)
        if amount <= capacity - book.used(resource):
            continue
        holders = ", ".join(
            f"{one.holder} ({one.wants[resource]})" if capacity > 1 else one.holder
            for one in book.granted
            if resource in one.wants
        )
        told.append(f"{resource} is held by {holders}")
    if told:
        return "; ".join(told)
    first = next((one for one in book.waiting if one.wants.keys() & wants.keys()), None)
    return f"{first.holder} waits before it" if first is not None else ""


def _require(book: Book, holder: str, resource: str, amount: int) -> None:
    capacity = book.capacities.get(resource)
    if capacity is None:
        known = ", ".join(sorted(book.capacities)) or "none"
        raise ClaimRefused(f"{holder} asks for {resource}, which nobody declares; known: {known}")
    if not 0 < amount <= capacity:
        raise ClaimRefused(f"{holder} asks for {amount} of {resource}, expected 1 to {capacity}")
