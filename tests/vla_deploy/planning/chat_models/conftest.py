from pathlib import Path

import pytest

from tests.vla_deploy.tiny_language_models import LLAMA, write_folder
from vla_deploy.inference.language_model import LanguageModel
from vla_deploy.inference.manifest import Language, LanguageUse
from vla_deploy.inference.opening import PLAIN_CHOICE


@pytest.fixture
def model(tmp_path: Path) -> LanguageModel:
    folder = write_folder(tmp_path / "tiny", LLAMA)
    return LanguageModel(folder, Language(use=LanguageUse.CHAT, most_tokens=64), PLAIN_CHOICE)
