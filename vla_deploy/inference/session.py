"""Run a model: a verified session that is warm, and counts what it costs."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from drivers.clock import NS_PER_S, Clock
from drivers.latency import LatencyHistogram
from platforms import ModelChoice
from vla_deploy.inference.errors import ModelMismatch, RunFailed
from vla_deploy.inference.graph_check import output_faults
from vla_deploy.inference.manifest import Manifest, Tensor, TensorLayout, Variant
from vla_deploy.inference.memory_claims import MemoryClaim, resident_mb
from vla_deploy.inference.opening import GraphSession, open_model_graph
from vla_deploy.inference.providers import variant_for
from vla_deploy.inference.runtime import available_providers
from vla_deploy.inference.store import StoredModel

Arrays = Mapping[str, NDArray[Any]]
WARM_UP_RUNS: Final = 2  # the first one lays out the memory that the next ones use


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionStats:
    """Hold what one session is and what it has cost so far.

    `memory_mb` is by how much the process grew while the session was opened and warmed up; other
    threads of the process may have a share in it. `busy_s` is the time of all runs. `notices`
    say where it is not as was asked.
    """

    model: str
    role: str
    variant: Variant
    provider: str
    threads: int
    runs: int
    busy_s: float
    failures: int
    p50_s: float
    p95_s: float
    max_s: float
    load_s: float
    memory_mb: float
    notices: tuple[str, ...]

    def document(self) -> dict[str, Any]:
        """Return the values for a status topic, as JSON takes them."""
        return {**asdict(self), "notices": list(self.notices)}


class ModelSession:
    """Run one model in this thread or another one; one run at a time."""

    def __init__(
        self, model: StoredModel, choice: ModelChoice, graph: GraphSession, clock: Clock
    ) -> None:
        self.model = model
        self.provider = graph.provider
        self.variant, _ = variant_for(model.manifest, choice.precision, graph.provider)
        self.notices = graph.notices
        self._threads = choice.threads
        self._graph = graph
        self._outputs = [tensor.name for tensor in model.manifest.outputs]
        self._clock = clock
        self._latency = LatencyHistogram()
        self._failures = 0
        self.load_s = 0.0
        self.memory_mb = 0.0
        self.claim = MemoryClaim()

    def run(self, inputs: Arrays) -> dict[str, NDArray[Any]]:
        """Return the outputs by name.

        Raises:
            RunFailed: inputs do not fit, the provider failed, or the session is closed.
        """
        started_ns = self._clock.now_ns()
        try:
            outputs = self._graph.run(self._outputs, inputs)
        except RunFailed:
            self._failures += 1
            raise
        self._latency.record(self._clock.now_ns() - started_ns)
        return outputs

    def warm_up(self, runs: int = WARM_UP_RUNS) -> None:
        """Run on zeros, so that the first real run takes no longer than the next ones.

        Raises:
            ModelMismatch: outputs do not have the shapes of the manifest.
            RunFailed: the model fails.
        """
        manifest = self.model.manifest
        zeros = {
            tensor.name: np.zeros(run_shape(manifest, tensor), dtype=tensor.dtype)
            for tensor in manifest.inputs
        }
        for _ in range(runs):
            faults = tuple(output_faults(self._graph.run(self._outputs, zeros), manifest))
            if faults:
                raise ModelMismatch(manifest.name, faults)

    def stats(self) -> SessionStats:
        """Return what this session has cost so far; warm-up counts as loading."""
        manifest, latency = self.model.manifest, self._latency
        return SessionStats(
            model=manifest.name,
            role=manifest.role,
            variant=self.variant,
            provider=self.provider,
            threads=self._threads,
            runs=latency.count,
            busy_s=latency.total_ns / NS_PER_S,
            failures=self._failures,
            p50_s=latency.percentile_ns(0.5) / NS_PER_S,
            p95_s=latency.percentile_ns(0.95) / NS_PER_S,
            max_s=latency.max_ns / NS_PER_S,
            load_s=self.load_s,
            memory_mb=self.memory_mb,
            notices=self.notices,
        )

    def close(self) -> None:
        """Release the memory; a run after that fails."""
        self._graph.close()
        self.claim.release()


def open_session(
    model: StoredModel,
    choice: ModelChoice,
    *,
    engines: Path,
    clock: Clock,
    available: tuple[str, ...] | None = None,
) -> ModelSession:
    """Open a model as a profile's choice asks, verify what runs it, and warm it up.

    `engines` is the folder where providers keep what they build; `available` replaces the
    providers that this build of onnxruntime has.

    Raises:
        ModelFileSpoiled: the file is not what was checked in, or no ONNX graph.
        ModelMismatch: the graph is not what the manifest says.
        ProviderUnavailable: no provider that the choice allows runs it.
        RunFailed: it cannot run.
    """
    before_mb, started_ns = resident_mb(), clock.now_ns()
    providers = available_providers() if available is None else available
    graph = open_model_graph(model, choice, engines, providers)
    session = ModelSession(model, choice, graph, clock)
    session.warm_up()
    session.load_s = (clock.now_ns() - started_ns) / NS_PER_S
    session.memory_mb = max(0.0, resident_mb() - before_mb)
    return session


def run_shape(manifest: Manifest, tensor: Tensor) -> tuple[int, ...]:
    """Return the shape of one run's input: free dimensions are 1, those of images the declared."""
    if manifest.detection is None:
        return tuple(one if isinstance(one, int) else 1 for one in tensor.shape)
    image = manifest.detection.image
    size = (image.height_px, image.width_px)
    return (1, 3, *size) if image.layout == TensorLayout.NCHW else (1, *size, 3)
