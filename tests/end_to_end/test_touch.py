"""What the fingers feel in physics, and what becomes of a thing that a hand loses."""

from typing import Any

import pytest

from sim_twin.stack import LockstepStack

pytestmark = pytest.mark.gl


def scene(stack: LockstepStack) -> dict[str, Any]:
    sample = stack.space.cell_reader("scene").latest()
    assert sample is not None
    return sample.document()


def left_hand(stack: LockstepStack) -> dict[str, Any]:
    hand: dict[str, Any] = scene(stack)["hands"]["left"]
    return hand


def thing(stack: LockstepStack, name: str) -> dict[str, Any]:
    return next(one for one in scene(stack)["objects"] if one["id"] == name)


@pytest.mark.timeout(240)
def test_what_is_snatched_from_the_hand_is_no_longer_held_and_is_known_to_lie_near(
    stack: LockstepStack,
) -> None:
    assert stack.say("pick up the red cup")["success"]
    assert stack.lockstep.truth()["held"] == ["red_cup"]
    hand = left_hand(stack)
    assert (hand["holding"], hand["class"], hand["felt"]) == ("cup_1", "cup", "holding")
    assert hand["confirmed"]
    assert hand["width_m"] == pytest.approx(0.066, abs=0.005)
    held_at = thing(stack, "cup_1")["position_m"]

    stack.lockstep.twin.engine.place("red_cup", 6.3, 4.4, 0.5475, 0.0)
    stack.lockstep.run_for(1.0)
    hand = left_hand(stack)
    assert (hand["holding"], hand["class"], hand["felt"]) == (None, None, "lost")
    assert hand["told"] is None, "the executor believes the fingers"
    # Nothing pushes back any more while the fingers close, or they have closed already.
    assert hand["cause"].startswith(("it slipped out", "it is gone"))
    gone = [one for one in (*scene(stack)["objects"], *scene(stack)["lost"])
            if one["id"] == "cup_1"]  # fmt: skip
    assert len(gone) == 1
    assert "the left hand lost it" in gone[0]["cause"]
    assert gone[0]["position_m"] == pytest.approx(held_at, abs=0.1)
    assert gone[0]["sigma_m"][0] == pytest.approx(0.25)

    stack.say("open the left gripper")
    assert left_hand(stack)["felt"] == "empty"
