"""Write the MJCF of `so101_pair` from that of `so101`: two of its arms, and one camera between.

    python scripts/so101_pair.py

A test compares the file with what this writes: change so101.xml, or this, never the file itself.
"""

import copy
from collections.abc import Iterable
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

Element = ElementTree.Element
ROBOTS: Final = Path(__file__).parent.parent / "vla_deploy" / "robots"
PAIR: Final = ROBOTS / "so101_pair" / "so101_pair.xml"
SIDES_M: Final = {"left": 0.15, "right": -0.15}
"""Where each arm stands, y of its base."""
_NAMING: Final = ("name", "joint", "body1", "body2")
_HEAD: Final = """<mujoco model="so101_pair">
  <!-- Two SO-101 side by side on one table, made from so101.xml by scripts/so101_pair.py: change
       those. `base` is on the table between the two, x forward, y left; the pan axes are at
       x = 0.0388, y = 0.15 and -0.15. Every name of an arm begins with its side. -->
"""
_CAMERA: Final = """
<body name="camera_stand">
  <geom class="shell" size="0.006 0.006 0.25" pos="-0.09 0 0.25" material="so101_servo"/>
  <geom class="shell" size="0.0125 0.045 0.012" pos="-0.072 0 0.506"
        xyaxes="0.887 0 0.4617 0 1 0" material="so101_servo"/>
  <site name="table_camera" pos="-0.06 0 0.5" xyaxes="0 -1 0 -0.887 0 -0.4617"/>
  <camera name="table_camera" pos="-0.06 0 0.5" xyaxes="0 -1 0 0.887 0 0.4617" fovy="54"/>
</body>"""


def pair_text() -> str:
    """Return the MJCF of the pair."""
    builder = ElementTree.TreeBuilder(insert_comments=True)
    parser = ElementTree.XMLParser(target=builder)
    root = ElementTree.parse(ROBOTS / "so101" / "so101.xml", parser).getroot()
    world = root.find("worldbody")
    assert world is not None, "so101.xml has a robot"
    arm = world[0]
    arm[:] = [
        one for one in arm if one.get("name") != "camera_stand" and one.tag != ElementTree.Comment
    ]
    base = Element("body", {"name": "base"})
    base.extend([ElementTree.fromstring(_CAMERA), *(_at(arm, side) for side in SIDES_M)])
    world[:] = [base]
    for table in ("contact", "actuator"):
        rows = root.find(table)
        assert rows is not None, f"so101.xml has {table}"
        rows[:] = [one for side in SIDES_M for one in _renamed(rows, side)]
    root[:] = [one for one in root if one.tag != ElementTree.Comment]
    ElementTree.indent(root)
    body = ElementTree.tostring(root, encoding="unicode").partition("\n")[2]
    return _HEAD + body.replace(" />", "/>") + "\n"


def _at(arm: Element, side: str) -> Element:
    (own,) = _renamed([arm], side)
    own.set("pos", f"0 {SIDES_M[side]:g} 0")
    return own


def _renamed(elements: Iterable[Element], side: str) -> list[Element]:
    """Return copies whose names, and references to names, begin with a side."""
    copies = [copy.deepcopy(one) for one in elements]
    for element in (inner for one in copies for inner in one.iter()):
        for key in _NAMING:
            if key in element.attrib:
                element.set(key, f"{side}_{element.attrib[key]}")
    return copies


if __name__ == "__main__":
    PAIR.write_text(pair_text(), encoding="utf-8")
