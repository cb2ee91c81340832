"""Open an onnxruntime session as a profile asks, and make sure that it is what was asked.

onnxruntime answers a provider that it cannot give with a session on the CPU and a warning, and
lists a provider that then computes nothing. Both are found here.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from platforms import ModelChoice
from vla_deploy.inference.errors import ModelFileSpoiled, ModelMismatch, ProviderUnavailable
from vla_deploy.inference.file_check import checked_file
from vla_deploy.inference.graph_check import class_names, graph_faults, tensors_of
from vla_deploy.inference.manifest import Tensor, Variant
from vla_deploy.inference.providers import (
    CPU,
    TENSORRT,
    candidates,
    provider_list,
    variant_for,
)
from vla_deploy.inference.runtime import (
    SESSION_ERRORS,
    VERSION,
    InferenceSession,
    SessionOptions,
)
from vla_deploy.inference.store import StoredModel
from vla_deploy.runtime.one_line import one_line

_FATAL_ONLY: Final = 4  # what goes wrong is raised, and told once
_HASH_DIGITS: Final = 12
_ENTRIES: Final[Mapping[str, str]] = {
    # Threads that spin between runs would take the cores that control needs.
    "session.intra_op.allow_spinning": "0",
    "session.record_ep_graph_assignment_info": "1",
}


# To look at a model by itself, as no profile is needed for.
PLAIN_CHOICE: Final = ModelChoice(
    tiers=(),
    providers=(CPU,),
    precision="fp32",
    threads=1,
    cpu_fallback=False,
    memory_arena=True,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Opened:
    """Hold a session of onnxruntime, what runs it, and where that is not what was asked."""

    session: Any
    variant: Variant
    provider: str
    notices: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Graph:
    """Hold what an ONNX file itself tells: inputs, outputs, and classes where it names them."""

    inputs: tuple[Tensor, ...]
    outputs: tuple[Tensor, ...]
    classes: tuple[str, ...]


class _Refused(Exception):
    """Say why a provider does not run the model; the next one may."""


def open_with_choice(
    model: StoredModel, choice: ModelChoice, engines: Path, available: tuple[str, ...]
) -> Opened:
    """Open a session with the first provider of the choice that really runs the model.

    Raises:
        ModelFileSpoiled: the file is not what was checked in, or no ONNX graph.
        ModelMismatch: the graph is not what the manifest says.
        ProviderUnavailable: no provider that the choice allows runs it.
    """
    refusals: list[str] = []
    for provider in candidates(choice):
        try:
            opened = _open(model, choice, provider, engines, available)
        except _Refused as refusal:
            refusals.append(f"{provider}: {refusal}")
            continue
        faults = tuple(graph_faults(opened.session, model.manifest))
        if faults:
            file = model.folder / model.manifest.files[opened.variant].path
            raise ModelMismatch(str(file), faults)
        return Opened(
            session=opened.session,
            variant=opened.variant,
            provider=provider,
            notices=(*refusals, *opened.notices),
        )
    raise ProviderUnavailable(_no_provider(model.manifest.name, choice, refusals))


def open_graph(
    path: Path, choice: ModelChoice, available: tuple[str, ...]
) -> tuple[Any, str, tuple[str, ...]]:
    """Return a session of one file, its provider, and where that is not what was asked.

    TensorRT is passed over: it would build an engine for every length of the tensors.

    Raises:
        ModelFileSpoiled: it is no ONNX graph that a CPU can run.
        ProviderUnavailable: no provider that the choice allows runs it.
    """
    refusals: list[str] = []
    for provider in candidates(choice):
        if provider == TENSORRT:
            continue
        if provider not in available:
            refusals.append(
                f"{provider}: this onnxruntime {VERSION} has only {', '.join(available)}"
            )
            continue
        try:
            session = _create(path, provider, [(provider, {})], session_options(choice))
            return session, provider, (*refusals, *_verified(session, provider))
        except _Refused as refusal:
            refusals.append(f"{provider}: {refusal}")
    raise ProviderUnavailable(_no_provider(path.parent.name, choice, refusals))


def read_graph(path: Path) -> Graph:
    """Return what a file tells of its graph.

    Raises:
        ModelFileSpoiled: it is no ONNX graph that a CPU can run.
    """
    session = _create(path, CPU, [(CPU, {})], session_options(PLAIN_CHOICE))
    return Graph(
        inputs=tensors_of(session.get_inputs()),
        outputs=tensors_of(session.get_outputs()),
        classes=class_names(session),
    )


def _open(
    model: StoredModel,
    choice: ModelChoice,
    provider: str,
    engines: Path,
    available: tuple[str, ...],
) -> Opened:
    if provider not in available:
        raise _Refused(f"this onnxruntime {VERSION} has only {', '.join(available)}")
    variant, note = variant_for(model.manifest, choice.precision, provider)
    path = checked_file(model, variant)
    notices = [note] if note else []
    if provider == TENSORRT:
        engines = (
            engines / model.manifest.name / model.manifest.files[variant].sha256[:_HASH_DIGITS]
        )
        notices += _make_folder(engines)
    asked = provider_list(provider, choice, available, engines)
    session = _create(path, provider, asked, session_options(choice))
    notices += _verified(session, provider)
    return Opened(session=session, variant=variant, provider=provider, notices=tuple(notices))


def session_options(choice: ModelChoice) -> Any:
    """Return the options of a session: threads and memory as the choice says."""
    options = SessionOptions()
    options.intra_op_num_threads = choice.threads
    options.inter_op_num_threads = 1
    options.enable_cpu_mem_arena = choice.memory_arena
    options.enable_mem_pattern = choice.memory_arena
    options.log_severity_level = _FATAL_ONLY
    for key, value in _ENTRIES.items():
        options.add_session_config_entry(key, value)
    return options


def _create(
    path: Path, provider: str, asked: list[tuple[str, dict[str, str]]], options: Any
) -> Any:
    """Create the session.

    Raises:
        ModelFileSpoiled: not even the CPU runs the file.
        _Refused: the provider does not run it.
    """
    try:
        # Without this, onnxruntime tries again with other providers by itself.
        return InferenceSession(str(path), options, providers=asked, enable_fallback=0)
    except SESSION_ERRORS as error:
        if provider != CPU:
            raise _Refused(one_line(error)) from error
        raise ModelFileSpoiled(
            f"{path}: onnxruntime {VERSION} cannot load it: {one_line(error)}; "
            "expected one whole ONNX file; export it again, weights included"
        ) from error


def _verified(session: Any, provider: str) -> list[str]:
    """Return what the provider leaves to the CPU.

    Raises:
        _Refused: it is not in the session, or computes nothing.
    """
    got = session.get_providers()
    if provider not in got:
        raise _Refused(f"onnxruntime silently took {', '.join(got)} instead")
    nodes = assigned_nodes(session)
    if provider == CPU or not nodes:
        return []
    if not nodes[provider]:
        raise _Refused(f"it is listed but computes none of the {nodes.total()} nodes")
    on_cpu = nodes[CPU]
    return [f"{provider} leaves {on_cpu} of {nodes.total()} nodes to the CPU"] if on_cpu else []


def assigned_nodes(session: Any) -> Counter[str]:
    """Return how many nodes each provider computes; empty where onnxruntime cannot tell."""
    if not hasattr(session, "get_provider_graph_assignment_info"):  # since 1.24
        return Counter()
    counts: Counter[str] = Counter()
    for part in session.get_provider_graph_assignment_info():
        counts[part.ep_name] += len(part.get_nodes())
    return counts


def _make_folder(engines: Path) -> list[str]:
    try:
        engines.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        return [f"engines are built anew at each start, {engines} cannot be made: {error.strerror}"]
    return []


def _no_provider(name: str, choice: ModelChoice, refusals: list[str]) -> str:
    hint = (
        "correct the installation of onnxruntime"
        if choice.cpu_fallback or CPU in choice.providers
        else "install an onnxruntime that has one of them, or set cpu_fallback in the profile"
    )
    return f"{name}: no provider runs it: {'; '.join(refusals)}; {hint}"
