"""Goals judged against scenes that differ in one thing."""

import pytest

from vla_deploy.analysis.document import Feasible


@pytest.fixture
def judge(geometric, ask):
    """Judge a goal about some things."""
    return lambda goal, *things, **more: geometric.analyse(ask(*things, goal=goal, **more)).task


@pytest.fixture
def cup(thing):
    return thing("cup_1", "red", 2.2, 1.6)


def test_a_free_cup_within_reach_can_be_picked_up(judge, cup):
    task = judge("pick up the red cup", cup)
    assert (task.feasible, task.confidence) == (Feasible.YES, pytest.approx(0.9))
    assert (task.prerequisites, task.obstacles) == ((), ())


def test_it_can_be_put_into_a_box_that_it_fits_into(judge, cup, thing):
    box = thing("box_1", "brown", 4.2, 0.5, bottom_m=0.4)
    assert judge("pick up the red cup and put it in the box", cup, box).feasible is Feasible.YES


def test_confidence_falls_with_every_thing_that_is_relied_on(judge, cup, thing):
    box = thing("box_1", "brown", 4.2, 0.5, bottom_m=0.4, confidence=0.5)
    task = judge("put the red cup in the box", cup, box)
    assert task.confidence == pytest.approx(0.9 * 0.5)


def test_what_stands_on_it_must_be_taken_off_first(judge, thing):
    book = thing("book_1", "blue", 2.2, 1.6, size_m=(0.20, 0.06, 0.03))
    ball = thing("ball_1", "green", 2.2, 1.6, bottom_m=0.48)
    task = judge("pick up the book", book, ball)
    assert task.feasible is Feasible.AFTER_PREREQUISITES
    assert task.prerequisites == ("take the green ball off the blue book",)
    assert task.obstacles == ("the green ball is on it",)


def test_a_neighbour_that_leaves_no_room_for_fingers_must_be_moved(judge, cup, thing):
    walls = [
        thing(f"bottle_{n}", "white", 2.2 + dx, 1.6 + dy, size_m=(0.11, 0.11, 0.2))
        for n, (dx, dy) in enumerate(((0.1, 0.0), (-0.1, 0.0), (0.0, 0.1), (0.0, -0.1)))
    ]
    task = judge("pick up the red cup", cup, *walls)
    assert task.feasible is Feasible.AFTER_PREREQUISITES
    assert all("white bottle away from the red cup" in one for one in task.prerequisites)


def test_full_hands_must_be_emptied_first(judge, cup):
    task = judge("pick up the red cup", cup, holding={"left": "ball", "right": "book"})
    assert task.feasible is Feasible.AFTER_PREREQUISITES
    assert task.prerequisites == ("put down the ball in the left hand",)


def test_what_is_too_wide_for_the_fingers_cannot_be_taken_but_others_can(judge, cup, thing):
    wide = thing("cup_2", "blue", 2.5, 1.5, size_m=(0.14, 0.14, 0.1))
    task = judge("pick up the blue cup", wide, cup)
    assert (task.feasible, task.confidence) == (Feasible.NO, pytest.approx(0.9))
    assert "too wide" in task.reason or "mm wide" in task.reason
    assert task.alternatives == ("take the red cup (cup_1)",)


@pytest.mark.parametrize("bottom_m", [0.0, 1.1])
def test_what_is_too_low_or_too_high_cannot_be_taken(judge, thing, bottom_m):
    cup = thing("cup_1", "red", 2.2, 1.6, bottom_m=bottom_m)
    assert judge("pick up the red cup", cup).feasible is Feasible.NO


def test_what_stands_where_no_base_fits_cannot_be_taken(judge, thing):
    behind_the_wall = thing("cup_1", "red", 2.2, -1.5)
    task = judge("pick up the red cup", behind_the_wall)
    assert (task.feasible, "no place to stand" in task.reason) == (Feasible.NO, True)


def test_a_box_is_too_large_to_grasp(judge, thing):
    task = judge("pick up the box", thing("box_1", "brown", 2.2, 1.6))
    assert (task.feasible, task.reason) == (Feasible.NO, "a box is too large to grasp")


def test_a_cup_is_no_container_but_the_box_there_is_one(judge, cup, thing):
    box, ball = thing("box_1", "brown", 4.2, 0.5, bottom_m=0.4), thing("ball_1", "blue", 2.4, 1.6)
    task = judge("put the ball in the red cup", cup, box, ball)
    assert (task.feasible, task.reason) == (Feasible.NO, "a cup is no container")
    assert task.alternatives == ("put it in the brown box (box_1)",)


def test_what_is_wider_than_the_box_does_not_go_in(judge, cup, thing):
    tiny = thing("box_1", "brown", 4.2, 0.5, bottom_m=0.4, size_m=(0.07, 0.07, 0.08))
    task = judge("put the red cup in the box", cup, tiny)
    assert (task.feasible, "70 mm wide" in task.reason) == (Feasible.NO, True)


def test_a_thing_that_nobody_has_seen_leaves_the_verdict_open(judge, cup):
    task = judge("pick up the green bottle", cup)
    assert (task.feasible, task.confidence) == (Feasible.UNKNOWN, 0.0)
    assert task.prerequisites[0].startswith("find the green bottle: it has not been seen")
    assert task.alternatives == ()
    assert judge("pick up the blue cup", cup).alternatives == ("take the red cup (cup_1)",)


@pytest.mark.parametrize("goal", ["go to the kitchen", "drive to the charger"])
def test_a_place_with_a_way_can_be_reached(judge, goal):
    task = judge(goal)
    assert (task.feasible, task.confidence) == (Feasible.YES, 1.0)


def test_people_beside_the_way_are_told(judge):
    person = {"class": "person", "position_m": [2.2, 2.4], "width_m": 0.5}
    task = judge("go to the kitchen", bystanders=(person,))
    assert (task.feasible, "person stands" in task.obstacles[0]) == (Feasible.YES, True)


def test_without_a_pose_the_robot_must_find_itself_first(judge):
    task = judge("go to the kitchen", robot=None)
    assert task.prerequisites == ("find out where the robot is",)


def test_a_straight_way_into_the_table_ends_before_it(judge):
    task = judge("move forward 1 m")
    assert task.feasible is Feasible.NO
    assert "m something stands in the way" in task.reason
    assert task.alternatives[0].endswith("at most")
    assert judge("move backward 0.2 m").feasible is Feasible.YES


def test_an_unknown_place_and_an_unknown_kind_are_no(judge):
    assert judge("go to the moon").feasible is Feasible.NO
    assert judge("pick up the elephant").feasible is Feasible.NO


def test_a_goal_that_no_rule_covers_is_unknown(judge):
    task = judge("make me happy")
    assert (task.feasible, task.confidence) == (Feasible.UNKNOWN, 0.0)


def test_nothing_can_be_put_down_that_is_not_held(judge, thing):
    task = judge("put it in the box", thing("box_1", "brown", 4.2, 0.5, bottom_m=0.4))
    assert task.feasible is Feasible.NO


def test_what_is_held_is_put_down_without_being_taken_again(judge, thing):
    cup = thing("cup_1", "red", 2.2, 1.6, held_by="left")
    box = thing("box_1", "brown", 4.2, 0.5, bottom_m=0.4)
    task = judge("put it in the box", cup, box, holding={"left": "cup", "right": None})
    assert task.feasible is Feasible.YES


@pytest.mark.parametrize("goal", ["wait 5 s", "say hello", "turn left", "open the gripper"])
def test_what_the_world_cannot_refuse_is_feasible(judge, goal):
    assert judge(goal).feasible is Feasible.YES


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
