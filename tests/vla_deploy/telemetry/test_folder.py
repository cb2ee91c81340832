import shutil
from collections import namedtuple
from pathlib import Path

import pytest

from vla_deploy.telemetry.errors import FlightMissing
from vla_deploy.telemetry.folder import FlightFolder, FolderBounds, folder_of

Usage = namedtuple("Usage", "total used free")


def saved(folder, label="x", size=10):
    part = folder.unfinished(label)
    part.write_bytes(bytes(size))
    return folder.publish(part)


def names(folder):
    return [path.name for path in folder.files()]


def test_flights_are_numbered_whatever_the_clock_says(tmp_path):
    folder = FlightFolder(tmp_path / "flights")
    for label in ("20990101-b", "19700101-a"):
        saved(folder, label)
    assert names(folder) == ["000001-20990101-b.mcap", "000002-19700101-a.mcap"]


@pytest.mark.parametrize(
    ("bounds", "left"),
    [
        (FolderBounds(files=3, spare_bytes=0), (3, 4, 5)),
        (FolderBounds(total_bytes=250, spare_bytes=0), (4, 5)),
    ],
)
def test_the_oldest_go_when_there_are_too_many_or_they_are_too_large(tmp_path, bounds, left):
    folder = FlightFolder(tmp_path, bounds)
    for _ in range(5):
        saved(folder, size=100)
    assert names(folder) == [f"00000{number}-x.mcap" for number in left]


def test_the_newest_stays_however_full_the_disk_is(tmp_path, monkeypatch):
    folder = FlightFolder(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(1000, 999, 1))
    for _ in range(3):
        saved(folder)
    assert names(folder) == ["000003-x.mcap"]


def test_a_half_written_flight_is_never_listed_and_swept_away_later(tmp_path):
    folder = FlightFolder(tmp_path)
    part = folder.unfinished("cut")
    part.write_bytes(b"half")
    assert names(folder) == []
    saved(folder)
    assert not part.exists()
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("name", ["2", "latest", "000002-x.mcap"])
def test_a_flight_is_found_by_number_name_or_as_the_latest(tmp_path, name):
    folder = FlightFolder(tmp_path)
    saved(folder)
    newest = saved(folder)
    assert folder.find(name) == newest
    assert folder.find(str(newest)) == newest


def test_a_flight_that_is_not_there_names_those_that_are(tmp_path):
    folder = FlightFolder(tmp_path)
    with pytest.raises(FlightMissing, match="none yet"):
        folder.find("latest")
    saved(folder)
    with pytest.raises(FlightMissing, match=r"no flight .7. .* 000001-x\.mcap"):
        folder.find("7")


def test_flights_outlive_the_run_beside_its_runtime_directory(tmp_path):
    assert folder_of(Path("/run/vla-deploy")) == Path("/var/lib/vla-deploy/flights")
    assert folder_of(tmp_path / "base") == tmp_path / "base-state" / "flights"
