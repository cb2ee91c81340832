"""A thing in a turning hand stays where it is held, and what is not held goes its own way."""

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from sim_twin.physics.held_things import HeldThings

TURN_RAD_S = 1.2
WORLD = """
<mujoco>
  <option timestep="0.002" integrator="implicitfast" cone="elliptic" impratio="100"
          gravity="0 0 0"/>
  <worldbody>
    <body name="base">
      <joint name="turn" axis="0 0 1"/>
      <geom type="box" size="0.1 0.1 0.1" mass="50" contype="0" conaffinity="0"/>
      <body name="left" pos="0.4 0.035 0">
        <joint name="left" type="slide" axis="0 -1 0" armature="0.1"/>
        <geom class="pad"/>
      </body>
      <body name="right" pos="0.4 -0.035 0">
        <joint name="right" type="slide" axis="0 1 0" armature="0.1"/>
        <geom class="pad"/>
      </body>
    </body>
    <body name="cup" pos="0.4 0 0">
      <freejoint/>
      <geom type="cylinder" size="0.03 0.04" mass="0.06"/>
    </body>
  </worldbody>
  <default>
    <default class="pad">
      <geom type="box" size="0.012 0.005 0.035" mass="0.03" condim="4" priority="1"
            friction="{friction} 0.01 0.0005" solref="0.01 1" solimp="0.95 0.99 0.001"/>
    </default>
  </default>
  <equality>
    <joint joint1="right" joint2="left" polycoef="0 1 0 0 0" solref="0.004 1"/>
  </equality>
  <actuator>
    <velocity joint="turn" kv="500"/>
    <motor joint="left"/>
    <motor joint="right"/>
  </actuator>
</mujoco>
"""


def wandered_m(
    *, friction: float = 1.2, squeeze_n: tuple[float, float] = (15.0, 15.0), corrects: bool = True
) -> float:
    """Turn for two seconds, and return how far the cup has moved in the hand."""
    model = mujoco.MjModel.from_xml_string(WORLD.format(friction=friction))
    data = mujoco.MjData(model)
    held = HeldThings(model, data)
    base, cup = model.body("base").id, model.body("cup").id

    def place_m() -> NDArray[np.float64]:
        mujoco.mj_kinematics(model, data)
        place: NDArray[np.float64] = data.xmat[base].reshape(3, 3).T @ data.xpos[cup]
        return place

    for tick in range(1600):
        data.ctrl[:] = (TURN_RAD_S if tick > 500 else 0.0, *squeeze_n)
        mujoco.mj_step(model, data)
        if corrects:
            held.step()
        if tick == 600:  # it turns steadily
            began_m = place_m()
    return float(np.linalg.norm(place_m() - began_m))


def test_a_cup_in_a_turning_hand_stays_where_it_is_held() -> None:
    assert wandered_m(corrects=False) > 1e-3
    assert wandered_m() < 2e-5


def test_a_hand_too_weak_to_hold_a_cup_loses_it_all_the_same() -> None:
    loose = wandered_m(friction=0.001, squeeze_n=(0.5, 0.5), corrects=False)
    assert loose > 0.03
    assert wandered_m(friction=0.001, squeeze_n=(0.5, 0.5)) == pytest.approx(loose, rel=0.1)


def test_what_one_finger_pushes_is_not_moved() -> None:
    left_alone = (0.5, -0.5)
    moved_m = wandered_m(squeeze_n=left_alone)
    assert moved_m == wandered_m(squeeze_n=left_alone, corrects=False)


def test_nothing_is_touched_while_nothing_is_held() -> None:
    model = mujoco.MjModel.from_xml_string(WORLD.format(friction=1.2))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    before = np.array(data.qpos)
    for _ in range(20):
        HeldThings(model, data).step()
    assert np.array_equal(before, data.qpos)
