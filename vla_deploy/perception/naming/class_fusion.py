"""Believe what many looks say rather than what the last one said."""

from collections.abc import Mapping

# As many full looks outweigh all that was believed before: a thing may be exchanged for another.
MOST_EVIDENCE = 24.0


class Belief:
    """Hold how much evidence there is for each of several names; `weights` default to 1 a look."""

    def __init__(self, otherwise: str, weights: Mapping[str, float] | None = None) -> None:
        self._otherwise = otherwise
        self._weights = weights or {}
        self._evidence: dict[str, float] = {}

    def add(self, name: str, share: float = 1.0) -> None:
        """Count one look; `share` below 1 is one that shows less."""
        self._evidence[name] = self._evidence.get(name, 0.0) + share * self._weights.get(name, 1.0)
        total = sum(self._evidence.values())
        if total > MOST_EVIDENCE:
            scale = MOST_EVIDENCE / total
            self._evidence = {known: scale * value for known, value in self._evidence.items()}

    def recall(self, shares: Mapping[str, float], looks: float) -> None:
        """Take over what was believed before, as from so many looks."""
        evidence = min(looks, MOST_EVIDENCE)
        self._evidence = {name: evidence * share for name, share in shares.items()}

    @property
    def best(self) -> str:
        """Return the likeliest name, the first seen of equals."""
        return max(self._evidence, key=self._evidence.__getitem__, default=self._otherwise)

    def share(self, name: str) -> float:
        """Return the probability of a name: its share of the evidence, 0 before the first look."""
        total = sum(self._evidence.values())
        return self._evidence.get(name, 0.0) / total if total else 0.0

    def shares(self, count: int) -> dict[str, float]:
        """Return the likeliest names with their probabilities, the likeliest first."""
        ranked = sorted(self._evidence, key=lambda name: (-self._evidence[name], name))
        return {name: self.share(name) for name in ranked[:count]}
