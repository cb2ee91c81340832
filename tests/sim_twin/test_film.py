from pathlib import Path

import cv2
import numpy as np
import pytest

from sim_twin.errors import FilmFault, RefereeRefusal
from sim_twin.physics.engine import Engine
from sim_twin.pictures.film import HEIGHT, WIDTH, Film, contact_sheet
from sim_twin.pictures.film_server import FilmServer

OWN = "head_camera"


@pytest.mark.gl
@pytest.mark.parametrize("ending", [".webm", ".mp4", ".avi"])
def test_a_film_can_be_played_back(engine: Engine, tmp_path: Path, ending: str) -> None:
    film = Film(engine.model, engine.data, tmp_path / f"film{ending}", camera=OWN)
    for _ in range(5):
        film.shoot()
    film.close()
    video = cv2.VideoCapture(str(film.path))
    frames = 0
    while (read := video.read())[0]:
        frames += 1
        assert read[1].shape == (HEIGHT, WIDTH, 3)
    assert frames == 5
    sheet = cv2.imread(str(film.sheet_path))
    assert sheet is not None
    assert sheet.shape == (4 * HEIGHT // 2, 3 * WIDTH // 2, 3)


@pytest.mark.gl
def test_a_caption_is_written_across_the_bottom(engine: Engine, tmp_path: Path) -> None:
    film = Film(engine.model, engine.data, tmp_path / "film.avi", camera=OWN)
    plain = film.shoot()
    film.caption = "pick_up: cup"
    captioned = film.shoot()
    film.close()
    strip = HEIGHT - 34
    assert np.abs(captioned[strip:].astype(int) - plain[strip:]).max() > 50


def test_an_unknown_ending_is_refused(engine: Engine, tmp_path: Path) -> None:
    with pytest.raises(FilmFault, match=r"\.mov"):
        Film(engine.model, engine.data, tmp_path / "film.mov", camera=OWN)


def test_a_path_that_cannot_be_written_is_refused(engine: Engine, tmp_path: Path) -> None:
    (tmp_path / "film.avi").mkdir()
    with pytest.raises(FilmFault, match="cannot write"):
        Film(engine.model, engine.data, tmp_path / "film.avi", camera=OWN)


def test_the_sheet_spreads_over_the_whole_film() -> None:
    frames = [np.full((36, 64, 3), shade, np.uint8) for shade in range(100)]
    sheet = contact_sheet(frames)
    assert sheet[0, 0, 0] == 0
    assert sheet[-1, -1, 0] == 99


@pytest.mark.gl
def test_the_film_server_shoots_at_the_films_rate_in_simulated_time(
    engine: Engine, tmp_path: Path
) -> None:
    desk = FilmServer(engine.model, engine.data, camera=OWN)
    desk.answer({"op": "film_start", "path": str(tmp_path / "film.avi")})
    desk.answer({"op": "caption", "text": "hello"})
    for step in range(0, 1_000_000_000, 20_000_000):
        if desk.is_due(step):
            desk.shoot(step)
    assert desk.answer({"op": "film_stop"})["frames"] == 5


@pytest.mark.parametrize("op", ["film_stop", "caption", "explode"])
def test_the_film_server_refuses_what_it_cannot_do(engine: Engine, op: str) -> None:
    with pytest.raises(RefereeRefusal):
        FilmServer(engine.model, engine.data, camera=OWN).answer({"op": op})


def test_a_film_needs_a_path(engine: Engine) -> None:
    with pytest.raises(RefereeRefusal, match="expected a path"):
        FilmServer(engine.model, engine.data, camera=OWN).answer({"op": "film_start"})
