"""Run a graph whose tensors grow from run to run, as those of a language model do."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from platforms import ModelChoice
from vla_deploy.inference.errors import RunFailed
from vla_deploy.inference.graph_check import tensors_of
from vla_deploy.inference.manifest import Tensor
from vla_deploy.inference.opening import open_graph
from vla_deploy.inference.runtime import SESSION_ERRORS, available_providers
from vla_deploy.runtime.one_line import one_line


class GraphSession:
    """Hold a session of onnxruntime that its owner feeds by the names of its tensors."""

    def __init__(self, path: Path, choice: ModelChoice) -> None:
        """Open a file with the first provider of a choice that really runs it.

        Raises:
            ModelFileSpoiled: it is no ONNX graph that a CPU can run.
            ProviderUnavailable: no provider that the choice allows runs it.
        """
        self.path = path
        self._session: Any
        self._session, self.provider, self.notices = open_graph(path, choice, available_providers())
        self.inputs: tuple[Tensor, ...] = tensors_of(self._session.get_inputs())
        self.outputs: tuple[Tensor, ...] = tensors_of(self._session.get_outputs())

    def run(
        self, names: Sequence[str], inputs: Mapping[str, NDArray[Any]]
    ) -> dict[str, NDArray[Any]]:
        """Return the named outputs.

        Raises:
            RunFailed: inputs do not fit, the provider failed, or the session is closed.
        """
        if self._session is None:
            raise RunFailed(f"{self.path}: its session is closed")
        try:
            outputs = self._session.run(list(names), dict(inputs))
        except SESSION_ERRORS as error:
            shapes = {name: f"{one.dtype}{list(one.shape)}" for name, one in inputs.items()}
            raise RunFailed(f"{self.path}, given {shapes}: {one_line(error)}") from error
        return dict(zip(names, outputs, strict=True))

    def close(self) -> None:
        """Release the memory; a run after that fails."""
        self._session = None
