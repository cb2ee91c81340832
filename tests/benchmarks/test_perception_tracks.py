from typing import Any

from benchmarks.perception_tracks import IdentityWatch


def told(**places: float) -> list[dict[str, Any]]:
    return [{"id": name, "position_m": [x_m, 0.0, 0.5]} for name, x_m in places.items()]


def real(**places: float) -> dict[str, Any]:
    return {name: {"position_m": [x_m, 0.0, 0.5]} for name, x_m in places.items()}


def test_a_thing_that_goes_by_one_id_switches_none() -> None:
    watch = IdentityWatch()
    for x_m in (1.0, 1.1, 1.2):
        watch.look(told(cup_1=x_m + 0.02, box_1=3.0), real(cup=x_m, box=3.01))
    assert (watch.switches, watch.ids) == ([], {"cup": "cup_1", "box": "box_1"})
    assert (watch.looks, watch.followed, watch.false_things) == (3, 6, 0)


def test_another_id_at_the_same_thing_is_a_switch() -> None:
    watch = IdentityWatch()
    watch.look(told(cup_1=1.0), real(cup=1.0))
    watch.look(told(), real(cup=1.0))
    watch.look(told(cup_2=1.0), real(cup=1.0))
    assert watch.switches == ["cup: cup_1 -> cup_2"]


def test_two_things_that_swap_ids_are_two_switches() -> None:
    watch = IdentityWatch()
    watch.look(told(cup_1=1.0, cup_2=2.0), real(left=1.0, right=2.0))
    watch.look(told(cup_1=2.0, cup_2=1.0), real(left=1.0, right=2.0))
    assert len(watch.switches) == 2


def test_a_nearer_newcomer_does_not_take_a_name_that_still_fits() -> None:
    watch = IdentityWatch()
    watch.look(told(cup_1=1.1), real(cup=1.0))
    watch.look(told(cup_1=1.1, ghost_1=1.0), real(cup=1.0))
    assert (watch.switches, watch.false_things) == ([], 1)


def test_what_is_told_where_nothing_is_counts_as_false() -> None:
    watch = IdentityWatch()
    watch.look(told(cup_1=1.0), real(cup=2.0))
    assert (watch.ids, watch.false_things) == ({}, 1)
