"""Open an onnxruntime session as a profile asks, and make sure that it is what was asked.

onnxruntime answers a provider that it cannot give with a session on the CPU and a warning, and
lists a provider that then computes nothing. Both are found here.
"""

import threading
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from numpy.typing import NDArray

from platforms import ModelChoice
from vla_deploy.inference.errors import (
    ModelFileSpoiled,
    ModelMismatch,
    ProviderUnavailable,
    RunFailed,
)
from vla_deploy.inference.graph_check import class_names, graph_faults, tensors_of
from vla_deploy.inference.providers import (
    CPU,
    TENSORRT,
    Options,
    candidates,
    provider_list,
    variant_for,
)
from vla_deploy.inference.runtime import (
    SESSION_ERRORS,
    VERSION,
    InferenceSession,
    RunOptions,
    SessionOptions,
    available_providers,
)
from vla_deploy.inference.store import StoredModel
from vla_deploy.runtime.one_line import one_line

FIRST_RUNS_WITHIN_S: Final = 300.0
"""A long prompt to a large language model on a slow processor takes a minute."""
WATCHED_RUNS: Final = 2
"""Those of the warm-up: a graph that never ends is found when it is added, or opened."""
_FATAL_ONLY: Final = 4  # what goes wrong is raised, and reported once
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


class GraphSession:
    """Hold an open graph, its tensors and what runs it; free dimensions may differ between runs.

    `classes` are those that the file itself names, `notices` say where it is not as was asked.
    """

    def __init__(
        self, path: Path, session: Any, provider: str, notices: tuple[str, ...] = ()
    ) -> None:
        self.path = path
        self.provider = provider
        self.notices = notices
        self.inputs = tensors_of(session.get_inputs())
        self.outputs = tensors_of(session.get_outputs())
        self.classes = class_names(session)
        self._session = session
        self._runs = 0

    def run(
        self, names: Sequence[str], inputs: Mapping[str, NDArray[Any]]
    ) -> dict[str, NDArray[Any]]:
        """Return the named outputs.

        Raises:
            RunFailed: inputs do not fit, the provider failed, one of the first runs took too long,
                or the session is closed.
        """
        if self._session is None:
            raise RunFailed(f"{self.path}: its session is closed")
        watch = RunWatch(FIRST_RUNS_WITHIN_S if self._runs < WATCHED_RUNS else None)
        self._runs += 1
        try:
            with watch as options:
                outputs = self._session.run(list(names), dict(inputs), options)
        except SESSION_ERRORS as error:
            if watch.is_over:
                raise RunFailed(
                    f"{self.path} on {self.provider}: no answer within {FIRST_RUNS_WITHIN_S:g} s, "
                    "it may loop for ever; take another model"
                ) from error
            shapes = {name: f"{one.dtype}{list(one.shape)}" for name, one in inputs.items()}
            raise RunFailed(
                f"{self.path} on {self.provider}, given {shapes}: {one_line(error)}"
            ) from error
        return dict(zip(names, outputs, strict=True))

    def close(self) -> None:
        """Release the memory; a run after that fails."""
        self._session = None


class RunWatch:
    """End a run that takes longer than a time limit; without one, watch nothing."""

    def __init__(self, within_s: float | None) -> None:
        self.is_over = False
        self._options = RunOptions()
        self._timer = None if within_s is None else threading.Timer(within_s, self._end)

    def __enter__(self) -> RunOptions:
        if self._timer is not None:
            self._timer.daemon = True
            self._timer.start()
        return self._options

    def __exit__(self, *_: object) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer.join()

    def _end(self) -> None:
        self.is_over = True
        self._options.terminate = True


class _Refused(Exception):
    """Say why a provider does not run the model; the next one may."""


def open_model_graph(
    model: StoredModel, choice: ModelChoice, engines: Path, available: tuple[str, ...]
) -> GraphSession:
    """Open a model's graph with the first provider of the choice that really runs it.

    Raises:
        ModelFileSpoiled: the file is not what was checked in, or no ONNX graph.
        ModelMismatch: the graph is not what the manifest says.
        ProviderUnavailable: no provider that the choice allows runs it.
    """

    def opened(provider: str) -> GraphSession:
        variant, note = variant_for(model.manifest, choice.precision, provider)
        path = model.checked_file(variant)
        notes = [note] if note else []
        folder = engines
        if provider == TENSORRT:
            digest = model.manifest.files[variant].sha256[:_HASH_DIGITS]
            folder = engines / model.manifest.name / digest
            notes += _make_folder(folder)
        asked = provider_list(provider, choice, available, folder)
        graph = _open(path, provider, asked, choice)
        faults = tuple(graph_faults(graph.inputs, graph.outputs, graph.classes, model.manifest))
        if faults:
            raise ModelMismatch(str(path), faults)
        graph.notices = (*notes, *graph.notices)
        return graph

    return _first_that_runs(model.manifest.name, choice, candidates(choice), available, opened)


def open_graph(path: Path, choice: ModelChoice = PLAIN_CHOICE) -> GraphSession:
    """Open one file with the first provider of a choice that really runs it.

    TensorRT is passed over: it would build an engine for every length of the tensors.

    Raises:
        ModelFileSpoiled: it is no ONNX graph that a CPU can run.
        ProviderUnavailable: no provider that the choice allows runs it.
    """
    providers = [one for one in candidates(choice) if one != TENSORRT]
    return _first_that_runs(
        path.parent.name,
        choice,
        providers,
        available_providers(),
        lambda provider: _open(path, provider, [(provider, {})], choice),
    )


def _first_that_runs(
    name: str,
    choice: ModelChoice,
    providers: Sequence[str],
    available: tuple[str, ...],
    opened: Callable[[str], GraphSession],
) -> GraphSession:
    refusals: list[str] = []
    for provider in providers:
        if provider not in available:
            refusals.append(
                f"{provider}: this onnxruntime {VERSION} has only {', '.join(available)}"
            )
            continue
        try:
            graph = opened(provider)
        except _Refused as refusal:
            refusals.append(f"{provider}: {refusal}")
            continue
        graph.notices = (*refusals, *graph.notices)
        return graph
    hint = (
        "correct the installation of onnxruntime"
        if choice.cpu_fallback or CPU in choice.providers
        else "install an onnxruntime that has one of them, or set cpu_fallback in the profile"
    )
    raise ProviderUnavailable(f"{name}: no provider runs it: {'; '.join(refusals)}; {hint}")


def _open(
    path: Path, provider: str, asked: list[tuple[str, Options]], choice: ModelChoice
) -> GraphSession:
    """Open the session, and check what computes it.

    Raises:
        ModelFileSpoiled: not even the CPU runs the file.
        _Refused: the provider does not run it.
    """
    try:
        # Without `enable_fallback`, onnxruntime tries again with other providers by itself.
        session = InferenceSession(
            str(path), session_options(choice), providers=asked, enable_fallback=0
        )
    except SESSION_ERRORS as error:
        if provider != CPU:
            raise _Refused(one_line(error)) from error
        raise ModelFileSpoiled(
            f"{path}: onnxruntime {VERSION} cannot load it: {one_line(error)}; "
            "expected one whole ONNX file; export it again, weights included"
        ) from error
    return GraphSession(path, session, provider, _left_to_cpu(session, provider))


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


def _left_to_cpu(session: Any, provider: str) -> tuple[str, ...]:
    """Return what the provider leaves to the CPU, as a notice.

    Raises:
        _Refused: it is not in the session, or computes nothing.
    """
    got = session.get_providers()
    if provider not in got:
        raise _Refused(f"onnxruntime silently took {', '.join(got)} instead")
    nodes = _assigned_nodes(session)
    if provider == CPU or not nodes:
        return ()
    if not nodes[provider]:
        raise _Refused(f"it is listed but computes none of the {nodes.total()} nodes")
    on_cpu = nodes[CPU]
    return (f"{provider} leaves {on_cpu} of {nodes.total()} nodes to the CPU",) if on_cpu else ()


def _assigned_nodes(session: Any) -> Counter[str]:
    """Return how many nodes each provider computes; empty where onnxruntime cannot say."""
    counts: Counter[str] = Counter()
    if not hasattr(session, "get_provider_graph_assignment_info"):  # since 1.24; boards have older
        return counts
    for part in session.get_provider_graph_assignment_info():
        counts[part.ep_name] += len(part.get_nodes())
    return counts


def _make_folder(engines: Path) -> list[str]:
    try:
        engines.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        return [f"engines are built anew at each start, {engines} cannot be made: {error.strerror}"]
    return []
