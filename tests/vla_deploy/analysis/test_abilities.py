import pytest

from vla_deploy.analysis.document import Feasible


@pytest.mark.parametrize("hand", ["left", "right"])
def test_a_hand_gets_to_table_tops_but_neither_to_the_floor_nor_over_the_head(abilities, hand):
    reached = [abilities.arms.reach_height(hand, height_m) for height_m in (0.02, 0.48, 0.7, 1.5)]
    assert reached == [False, True, True, False]


def test_what_stands_too_high_is_no_destination(geometric, ask, thing):
    cup, shelf = thing("cup_1", "red", 2.2, 1.6), thing("box_1", "brown", 4.2, 0.5, bottom_m=1.2)
    task = geometric.analyse(ask(cup, shelf, goal="put the red cup in the box")).task
    assert task.feasible is Feasible.NO
    assert "hand does not reach above the brown box" in task.reason


def test_spoken_names_lead_to_the_robot_s_places(abilities):
    assert abilities.spoken["charging dock"] == "charging_station"
    assert abilities.planner.is_free(2.2, 2.05)
    assert not abilities.planner.is_free(2.2, 1.5)
