"""Find which model plays a role under a profile, and what it would run on."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from drivers.clock import Clock
from platforms import ModelChoice, Profile
from vla_deploy.inference.errors import ModelUnknown
from vla_deploy.inference.memory_claims import LoadedT, RunMemory
from vla_deploy.inference.session import ModelSession, open_session
from vla_deploy.inference.store import ModelStore, StoredModel
from vla_deploy.runtime.state_dir import engines_dir_of, models_dir_of

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelShelf:
    """Hold where models are, and where providers keep what they build from them."""

    store: ModelStore
    engines: Path
    clock: Clock
    memory: RunMemory | None = None

    @classmethod
    def of_base(cls, base: Path, clock: Clock) -> "ModelShelf":
        """Return the shelf for runs in a runtime directory; a run's own is one of its children."""
        return cls(store=ModelStore(models_dir_of(base)), engines=engines_dir_of(base), clock=clock)

    @classmethod
    def of_run(cls, run_dir: Path, clock: Clock) -> "ModelShelf":
        """Return the shelf of one run: models that it loads claim their memory there."""
        shelf = cls.of_base(run_dir.parent, clock)
        return replace(shelf, memory=RunMemory(run_dir / "ipc", clock))

    def load(self, model: StoredModel, choice: ModelChoice, load: Callable[[], LoadedT]) -> LoadedT:
        """Load a model, its memory claimed until it is closed; outside a run nothing is claimed.

        Raises:
            MemoryRefused: others hold what it needs.
        """
        return load() if self.memory is None else self.memory.load(model, choice, load)

    def open(self, role: str, profile: Profile, model_tier: int) -> ModelSession:
        """Open the model for a role, `model_tier` steps below the best; the last one at most.

        Takes its time and reads nothing that steps write: it suits a node's `prepare`.

        Raises:
            ModelUnknown: the profile has no model for the role, or one of another role, or an
                unknown one.
            ManifestInvalid: its manifest has faults.
            ModelFileSpoiled: its file is not what was checked in, or no ONNX graph.
            ModelMismatch: the graph is not what the manifest says.
            ProviderUnavailable: no provider that the profile allows runs it.
            MemoryRefused: others hold the memory that it needs.
            RunFailed: it cannot run.
        """
        choice = choice_for(role, profile)
        name = tier_name(choice, model_tier)
        model = self.store.load(name)
        if model.manifest.role != role:
            raise ModelUnknown(
                f"profile {profile.name}, models.{role}.tiers: {name} is a "
                f"{model.manifest.role}; see: vla-deploy models list"
            )
        session = self.load(
            model,
            choice,
            lambda: open_session(model, choice, engines=self.engines, clock=self.clock),
        )
        for notice in session.notices:
            _log.warning("degraded: %s", notice)
        return session


def choice_for(role: str, profile: Profile) -> ModelChoice:
    """Return what a profile says of a role.

    Raises:
        ModelUnknown: it says nothing.
    """
    choice = profile.models.get(role)
    if choice is None:
        declared = ", ".join(profile.models) or "none"
        raise ModelUnknown(
            f"profile {profile.name} has no [models.{role}], only: {declared}; "
            f"see: vla-deploy profile show {profile.name}"
        )
    return choice


def tier_name(choice: ModelChoice, model_tier: int) -> str:
    """Return the model of a tier; 0 is the best, beyond the last one there is none smaller."""
    return choice.tiers[min(model_tier, len(choice.tiers) - 1)]
