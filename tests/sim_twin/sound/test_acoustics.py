"""Paths through a room: delay, attenuation and reverberation."""

import numpy as np
import pytest

from sim_twin.sound.acoustics import SPEED_OF_SOUND_M_S, Acoustics, path, through

RATE_HZ = 16_000
ROOM = Acoustics(reverberation_s=0.3, critical_distance_m=1.0)


def test_the_direct_sound_comes_late_and_weak_by_its_distance() -> None:
    response = path(3.43, RATE_HZ, ROOM, seed=1)
    first = int(np.flatnonzero(response)[0])
    assert first == round(3.43 / SPEED_OF_SOUND_M_S * RATE_HZ) == 160
    assert response[first] == pytest.approx(1 / 3.43)


def test_at_the_critical_distance_the_room_carries_as_much_as_the_direct_way() -> None:
    response = path(1.0, RATE_HZ, ROOM, seed=1)
    direct = int(np.flatnonzero(response)[0])
    assert np.sum(response[direct + 1 :] ** 2) == pytest.approx(response[direct] ** 2, rel=1e-4)


def test_the_tail_falls_by_sixty_decibels_in_the_reverberation_time() -> None:
    tail = path(0.1, RATE_HZ, ROOM, seed=2)[100:]
    rows = round(0.05 * RATE_HZ)
    early, late = (np.sum(tail[at : at + rows] ** 2) for at in (0, round(0.2 * RATE_HZ)))
    assert 10 * np.log10(early / late) == pytest.approx(60 * 0.2 / 0.3, abs=3)


def test_through_a_path_is_the_convolution() -> None:
    random = np.random.default_rng(0)
    sound, response = (random.standard_normal(n).astype(np.float32) for n in (700, 90))
    assert through(sound, response) == pytest.approx(np.convolve(sound, response), abs=1e-4)
