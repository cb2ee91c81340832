"""What butler's hands reach, and where its base fits."""

import pytest

from vla_deploy.feasibility.abilities import Abilities
from vla_deploy.robots import load_robot


@pytest.fixture(scope="module")
def abilities() -> Abilities:
    return Abilities.of(load_robot("butler"))


@pytest.mark.parametrize("hand", ["left", "right"])
def test_a_hand_gets_to_table_tops_but_neither_to_the_floor_nor_over_the_head(abilities, hand):
    reached = [abilities.arms.reach_height(hand, height_m) for height_m in (0.02, 0.48, 0.7, 1.5)]
    assert reached == [False, True, True, False]


def test_spoken_names_lead_to_the_robot_s_places(abilities):
    assert abilities.spoken["charging dock"] == "charging_station"
    assert abilities.planner.is_free(2.2, 2.05)
    assert not abilities.planner.is_free(2.2, 1.5)
