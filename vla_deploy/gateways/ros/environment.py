"""TEMPORARY: replaced by the branch rosenv."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class RosEnvironment:
    python: Path
    variables: Mapping[str, str]
    origin: str


def find_environment(configured: str = "", workspace: str = "") -> RosEnvironment:
    return RosEnvironment(Path(os.environ["VLA_DEPLOY_ROS_PYTHON"]), {}, "x")


def link_packages(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    root = Path(__file__).parents[3]
    for name in ("vla_deploy", "drivers", "platforms"):
        link = folder / name
        if not link.is_symlink():
            link.symlink_to(root / name)
    return folder
