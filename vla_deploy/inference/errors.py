"""Group the errors of models by what the caller can do about them.

InferenceError
├── ModelUnknown         no model of that name, or a name that is taken: list what there is
├── ManifestInvalid      model.toml has faults: correct every one that is listed
├── ModelFileSpoiled     a file is missing, cut off or not what was checked in: add it again
├── ModelMismatch        graph, manifest and other files do not fit together: export anew
├── ProviderUnavailable  nothing here runs it as asked: correct the profile or the installation
├── MemoryRefused        others hold the memory it needs: take a smaller one, or raise the budget
├── AnswerFailed         a language model gives no whole answer: ask another
├── RunFailed            a run failed, or gave what cannot be: a robot goes on without the answer
├── ImagesInvalid        images or labels to measure with cannot be used: correct the folder
├── FetchFailed          a published model did not come: repair the network, or add it by hand
├── PackageMissing       an optional package is not installed: install it
└── AccuracyLost         quantising costs more accuracy than allowed: nothing was installed
"""

from pathlib import Path


class InferenceError(Exception):
    """Base of everything that models raise."""


class ModelUnknown(InferenceError):
    """Say that a name means no model, or may not be given to one."""


class ManifestInvalid(InferenceError):
    """Report every fault of one manifest at once."""

    def __init__(self, file: Path, faults: tuple[str, ...]) -> None:
        super().__init__(_listed(str(file), faults))
        self.file = file
        self.faults = faults


class ModelFileSpoiled(InferenceError):
    """Say that a model's file cannot be used."""


class ModelMismatch(InferenceError):
    """Report everything at once in which a model's files do not fit together."""

    def __init__(self, model: str, faults: tuple[str, ...]) -> None:
        super().__init__(_listed(model, faults))
        self.faults = faults


class ProviderUnavailable(InferenceError):
    """Say that no execution provider runs a model that the profile allows."""


class MemoryRefused(InferenceError):
    """Say who holds the memory that a model needs."""


class AnswerFailed(InferenceError):
    """Say why there is no whole answer: time, tokens, context, or a schema that is none."""


class RunFailed(InferenceError):
    """Say that a run of a model failed."""


class ImagesInvalid(InferenceError):
    """Say that images or labels cannot be used."""


class FetchFailed(InferenceError):
    """Say that a published model could not be fetched."""


class PackageMissing(InferenceError):
    """Say that an optional package is missing, and how to install it."""


class AccuracyLost(InferenceError):
    """Say that quantising costs more than was allowed."""


def _listed(subject: str, faults: tuple[str, ...]) -> str:
    if len(faults) == 1:
        return f"{subject}: {faults[0]}"
    return "\n".join([f"{subject}: {len(faults)} faults", *(f"  {fault}" for fault in faults)])
