"""See in the view Robot what the twin's robot sees, and where and how it is."""

import re
from typing import Any

import pytest
from playwright.sync_api import Locator, Page, expect

from sim_twin.harness.processes import ProcessStack

pytestmark = [pytest.mark.gl, pytest.mark.stack, pytest.mark.timeout(300)]

PLACE = re.compile(r"x (-?\d+\.\d+) m, y (-?\d+\.\d+) m")
COLOURS_IN_IT = """canvas => {
  const { width, height } = canvas;
  const pixels = canvas.getContext("2d").getImageData(0, 0, width, height).data;
  const seen = new Set();
  for (let at = 0; at < pixels.length; at += 4 * 97) {
    seen.add(`${pixels[at]} ${pixels[at + 1]} ${pixels[at + 2]}`);
  }
  return seen.size;
}"""


@pytest.fixture
def view(pages: Any) -> Page:
    page: Page = pages.of("anna", "robot")
    expect(page.get_by_role("heading", level=1)).to_have_text("Robot")
    return page


def card(page: Page, title: str) -> Locator:
    return page.get_by_role("region", name=title, exact=True)


def test_the_map_tells_where_the_twin_really_is(view: Page, robot: ProcessStack) -> None:
    told = card(view, "Map").locator("#map-told")
    expect(told).to_contain_text("tracking")
    match = PLACE.search(told.inner_text())
    assert match is not None
    really = robot.truth()["robot"]
    assert float(match[1]) == pytest.approx(really["x_m"], abs=0.1)
    assert float(match[2]) == pytest.approx(really["y_m"], abs=0.1)
    assert view.locator("canvas.map").evaluate(COLOURS_IN_IT) >= 4  # floor, walls, lidar, robot


def test_the_camera_is_live(view: Page) -> None:
    expect(card(view, "Camera").get_by_text("no data")).to_have_count(0)
    expect(card(view, "Camera").get_by_text(re.compile("^The camera sees"))).to_be_visible()
    expect(view.locator("canvas.camera")).to_be_visible()
    for _ in range(50):  # the image is drawn in a frame after its words
        if view.locator("canvas.camera").evaluate(COLOURS_IN_IT) > 20:
            return
        view.wait_for_timeout(100)
    raise AssertionError("the camera's image is not drawn")


def test_every_joint_is_told_in_numbers(view: Page, robot: ProcessStack) -> None:
    joints = card(view, "Joints")
    expect(joints.get_by_role("row")).to_have_count(17)  # sixteen servos and the head
    expect(joints).to_contain_text("16 joints, 16 with torque, no errors")
    row = joints.get_by_role("row", name="left elbow")
    expect(row).to_contain_text("°C")
    expect(row.get_by_role("button")).to_have_attribute("aria-pressed", "false")


def test_what_is_left_behind_gives_its_parts_back(view: Page) -> None:
    expect(view.locator("canvas.stage")).to_be_visible()
    view.evaluate("location.hash = '#/profile'")
    expect(view.get_by_role("heading", level=1)).to_have_text("Profile")
    expect(view.locator("canvas")).to_have_count(0)
    view.evaluate("location.hash = '#/robot'")
    expect(view.locator("canvas.stage")).to_be_visible()
