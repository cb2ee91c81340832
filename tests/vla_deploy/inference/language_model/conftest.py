from collections.abc import Callable
from pathlib import Path

import pytest

from tests.vla_deploy.tiny_language_models import folders_under
from vla_deploy.inference.language_model import LanguageModel
from vla_deploy.inference.manifest import Language, LanguageUse
from vla_deploy.inference.opening import PLAIN_CHOICE

Open = Callable[[Path], LanguageModel]


@pytest.fixture(scope="session")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return folders_under(tmp_path_factory.mktemp("models"))


@pytest.fixture(params=["llama", "qwen2"])
def folder(request: pytest.FixtureRequest, folders: dict[str, Path]) -> Path:
    return folders[request.param]


@pytest.fixture
def opened() -> Open:
    language = Language(use=LanguageUse.CHAT, most_tokens=64)
    return lambda folder: LanguageModel(folder, language, PLAIN_CHOICE)


@pytest.fixture
def model(folder: Path, opened: Open) -> LanguageModel:
    return opened(folder)
