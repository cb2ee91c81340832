"""How perception names things while its network, its camera and its budget change."""

import math
from collections.abc import Callable
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

from platforms import Profile, load_profile
from sim_twin.faults.line_tamper import Garbage, LineTamper, Stuck, Tampering
from vla_deploy.inference.errors import ModelUnknown
from vla_deploy.robots.floor_pose import Pose2D

if TYPE_CHECKING:
    from conftest import Rig

pytestmark = pytest.mark.gl

Rgb = NDArray[np.uint8]
Depth = NDArray[np.float32]
VIEW = Pose2D(2.2, 2.05, -math.pi / 2)
MakeRig = Callable[..., "Rig"]


def test_things_are_named_by_form_and_network_together(make_rig: MakeRig) -> None:
    rig = make_rig()
    rig.run_for(1.5)
    sight = rig.scene()["sight"]
    assert (sight["mode"], sight["why"], sight["late"]) == ("network", "", 0)
    assert sight["model"]["provider"] == "CPUExecutionProvider"
    assert sight["model"]["runs"] >= 3
    assert rig.scene()["image"] == {"use": "all", "faults": [], "refused": 0}
    assert {"cup_1", "ball_1", "book_1"} <= set(rig.known())


def with_detector(*tiers: str, required: bool = False) -> Profile:
    desktop = load_profile("desktop")
    choice = replace(desktop.models["detector"], tiers=tiers, required=required)
    return replace(desktop, models=MappingProxyType({"detector": choice}))


def test_without_its_network_the_robot_goes_on_by_form_and_says_why(
    make_rig: MakeRig,
) -> None:
    rig = make_rig(profile=with_detector("lost"))
    rig.run_for(1.0)
    sight = rig.scene()["sight"]
    assert (sight["mode"], sight["model"]) == ("form", None)
    assert "no model 'lost'" in sight["why"]
    assert {"cup_1", "ball_1", "book_1"} <= set(rig.known())


def test_a_profile_that_requires_the_network_does_not_start_without_it(
    make_rig: MakeRig,
) -> None:
    with pytest.raises(ModelUnknown, match="no model 'lost'"):
        make_rig(profile=with_detector("lost", required=True))


def test_a_network_that_cannot_be_opened_leaves_the_present_one_at_work(
    make_rig: MakeRig,
) -> None:
    rig = make_rig()
    with pytest.raises(ModelUnknown, match="no model 'lost'"):
        rig.node.prepare(with_detector("lost"), 0)
    rig.run_for(0.4)
    assert rig.scene()["sight"]["mode"] == "network"


def test_rate_and_network_change_between_two_images_and_back(make_rig: MakeRig) -> None:
    rig = make_rig()
    rig.run_for(0.5)
    precise = replace(rig.profile.models["detector"], precision="fp32")
    slow = replace(
        rig.profile, perception_rate_hz=2.0, models=MappingProxyType({"detector": precise})
    )
    before = rig.node.commit(rig.node.prepare(slow, 0))
    stamp_ns = rig.scene()["stamp_ns"]
    rig.run_for(1.2)
    model = rig.scene()["sight"]["model"]
    assert (model["variant"], model["runs"]) == ("fp32", 2)
    assert rig.scene()["stamp_ns"] > stamp_ns
    rig.node.discard(rig.node.commit(before))
    rig.run_for(0.5)
    assert rig.scene()["sight"]["model"]["variant"] == "int8_u8s8"


def test_a_budget_that_slows_perception_slows_its_looks(make_rig: MakeRig) -> None:
    rig = make_rig()
    rig.run_for(0.5)
    before = rig.scene()["sight"]["model"]["runs"]
    rig.node.slow(0.5)
    rig.run_for(2.0)
    looks = rig.scene()["sight"]["model"]["runs"] - before
    assert looks == pytest.approx(0.5 * 2.0 * rig.profile.perception_rate_hz, abs=1)


def covered(rgb: Rgb, depth: Depth) -> tuple[Rgb, Depth]:
    return rgb // 20, depth


def without_depth(rgb: Rgb, depth: Depth) -> tuple[Rgb, Depth]:
    return rgb, np.zeros_like(depth)


@pytest.mark.parametrize(
    ("spoil", "fault", "obstacles_go_on"),
    [(covered, "dark", True), (without_depth, "depth holes", False)],
)
def test_nothing_is_seen_in_a_spoiled_image_and_all_is_well_after_it(
    make_rig: MakeRig,
    spoil: Callable[[Rgb, Depth], tuple[Rgb, Depth]],
    fault: str,
    obstacles_go_on: bool,
) -> None:
    rig = make_rig()
    rig.run_for(1.0)
    known = rig.known()
    rig.spoil = spoil
    rig.run_for(0.3)
    scene, before = rig.scene(), rig.sample("near_obstacles")
    rig.run_for(0.6)
    after = rig.sample("near_obstacles")
    assert rig.scene()["stamp_ns"] == scene["stamp_ns"]
    assert set(rig.known()) == set(known)
    assert [text.partition(":")[0] for text in rig.scene()["image"]["faults"]] == [fault]
    assert (after.sequence > before.sequence) is obstacles_go_on
    rig.spoil = lambda rgb, depth: (rgb, depth)
    rig.run_for(0.6)
    assert rig.scene()["stamp_ns"] > scene["stamp_ns"]
    assert rig.scene()["image"]["faults"] == []


@pytest.mark.parametrize(
    "make_fault", [Stuck, lambda _: Garbage(seed=3)], ids=["repeats its last image", "noise"]
)
def test_a_camera_that_says_nothing_new_on_the_wire_is_told(
    make_rig: MakeRig, make_fault: Callable[[LineTamper], Tampering]
) -> None:
    rig = make_rig()
    rig.run_for(0.6)
    stamp_ns = rig.scene()["stamp_ns"]
    rig.camera_wire.add(make_fault(rig.camera_wire))
    rig.head_tilt = lambda t: 0.75 + 0.02 * math.sin(3.0 * t)
    rig.run_for(2.4)
    assert rig.scene()["stamp_ns"] <= stamp_ns + 250_000_000
    (fault,) = rig.scene()["image"]["faults"]
    assert fault.startswith("no new image")


def test_a_camera_that_is_unplugged_while_the_robot_drives_stops_telling_of_obstacles(
    make_rig: MakeRig,
) -> None:
    rig = make_rig()
    rig.run_for(0.5)
    began = rig.now / 1e9
    rig.base = lambda t: VIEW.compose(Pose2D(-0.2 * (t - began), 0.0, 0.0))
    rig.run_for(0.5)
    rig.lines["camera"].unplug()
    rig.run_for(0.2)
    before = rig.sample("near_obstacles")
    rig.run_for(0.5)
    after = rig.sample("near_obstacles")
    assert after.sequence == before.sequence
    assert list(rig.scene()["away"]) == ["camera"]
    position_m, _ = rig.pose_error()
    assert position_m < 0.05
