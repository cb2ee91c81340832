"""Import onnxruntime, here and nowhere else, with its telemetry off.

Its official wheels report each session to their maker unless this variable is set before the
library is loaded.
"""

import os

os.environ["ORT_DISABLE_TELEMETRY"] = "1"

import onnxruntime
from onnxruntime.capi import onnxruntime_pybind11_state as _state

SESSION_ERRORS: tuple[type[Exception], ...] = (
    RuntimeError,
    ValueError,
    *(
        member
        for member in vars(_state).values()
        if isinstance(member, type) and issubclass(member, Exception)
    ),
)

RunOptions = onnxruntime.RunOptions
InferenceSession = onnxruntime.InferenceSession
SessionOptions = onnxruntime.SessionOptions
VERSION: str = onnxruntime.__version__


def available_providers() -> tuple[str, ...]:
    """Return the execution providers that this build of onnxruntime has."""
    return tuple(onnxruntime.get_available_providers())
