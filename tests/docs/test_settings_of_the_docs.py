"""Every settings file that the documentation shows is one that the program takes."""

import re
import shutil
import tomllib
from pathlib import Path
from typing import Any

import pytest

from platforms import load_profile
from vla_deploy.inference.manifest_schema import manifest_faults
from vla_deploy.model_servers.settings import read_servers
from vla_deploy.robots import load_robot, schema
from vla_deploy.robots.loader import OVERRIDES_FILE, ROBOTS_DIR, SHAPES
from vla_deploy.robots.ros_settings import ROS
from vla_deploy.runtime.net import faults_of
from vla_deploy.runtime.table_schema import check_tables
from vla_deploy.telemetry.recording.settings import TelemetrySettings

DOCS = Path(__file__).parents[2] / "docs"
BLOCK = re.compile(r"^```toml\n([\s\S]*?)^```|((?:^ {4}\[[\w.]+\]\n)(?:^ {4}.*\n)+)", re.M)


def shown(*pages: str) -> list[tuple[str, dict[str, Any]]]:
    """Return text and content of every TOML file on these pages."""
    texts = []
    for page in pages:
        found = BLOCK.finditer((DOCS / f"{page}.md").read_text(encoding="utf-8"))
        texts += [match[1] or re.sub("^    ", "", match[2], flags=re.M) for match in found]
    return [(text, tomllib.loads(text)) for text in texts]


def test_dashboard_toml() -> None:
    files = shown("dashboard")
    assert len(files) == 2
    assert [fault for _, document in files for fault in faults_of(document)] == []


def test_recording_toml() -> None:
    ((_, document),) = shown("recording")
    assert TelemetrySettings.model_validate(document).recording.always


def test_servers_toml(tmp_path: Path) -> None:
    ((text, _),) = [one for one in shown("language-models") if "servers" in one[1]]
    (tmp_path / "servers.toml").write_text(text)
    assert set(read_servers(tmp_path / "servers.toml")) == {"bench", "cloud"}


@pytest.mark.parametrize("page", ["profiles", "planning", "models", "language-models", "budgets"])
def test_profiles(page: str, tmp_path: Path) -> None:
    files = [text for text, document in shown(page) if not document.keys() & {"role", "servers"}]
    assert files
    for text in files:
        inherits = "" if "inherits" in text else 'inherits = "desktop"\n'
        (tmp_path / "mine.toml").write_text(inherits + text)
        assert load_profile(tmp_path / "mine.toml").name == "mine"


def test_manifest() -> None:
    ((text, _),) = [one for one in shown("models") if one[1].get("name") == "mugs"]
    whole = tomllib.loads(text.replace('sha256 = "..."', f'sha256 = "{"0" * 64}"'))
    assert list(manifest_faults(whole, "mugs")) == []


@pytest.mark.parametrize("page", ["sensors", "speech", "safety", "can", "ros"])
def test_tables_of_robot_toml(page: str) -> None:
    files = shown(page)
    assert files
    for _, document in files:
        assert document.keys() <= schema.ROBOT.keys()
        assert [*check_tables(document, SHAPES)] == []


def test_overrides_toml_and_every_key_of_ros(tmp_path: Path) -> None:
    files = shown("robots")
    for number, (text, _) in enumerate(files):
        folder = shutil.copytree(ROBOTS_DIR / "butler", tmp_path / str(number))
        (folder / OVERRIDES_FILE).write_text(text)
        load_robot(folder)
    (ros,) = [document["ros"] for _, document in files if "ros" in document]
    assert set(ros) == set(ROS)


def test_the_overrides_that_make_a_camera_a_webcam(tmp_path: Path) -> None:
    ((text, _),) = shown("cameras")
    folder = shutil.copytree(ROBOTS_DIR / "so101", tmp_path / "so101")
    (folder / OVERRIDES_FILE).write_text(text)
    assert not load_robot(folder).camera.has_depth


def test_every_table_of_robot_toml_is_told() -> None:
    page = (DOCS / "robots.md").read_text(encoding="utf-8")
    assert [key for key in schema.ROBOT if f"`{key}`" not in page] == ["name", "mjcf"]
