"""Say what to install where an engine's Python package is missing."""

from collections.abc import Iterator
from contextlib import contextmanager

from training.voices.errors import EngineMissing


@contextmanager
def packaged(engine: str, package: str) -> Iterator[None]:
    """Import what lies in a package.

    Raises:
        EngineMissing: it is not installed.
    """
    try:
        yield
    except ImportError as error:
        raise EngineMissing(engine, "its package", package, by="pip install") from error
