"""A goal of a hand gives the hand back however it ends, but to the goal that takes its place."""

import json

GRIP = """
import json, sys
import numpy as np
from control_msgs.action import GripperCommand
from vla_deploy.client.motions import Ended, JointView
from vla_deploy.gateways.ros.inward.grippers import GripperAction, GripperJoint, Gripping
from vla_deploy.robots.description import Hand as Described

class Hand:
    kind = GripperCommand
    described = Described(name="h", arm="a", gripper="g", grip_site="s", opening_ratio=1.0)
    fingers = GripperJoint(group="g", joint="j", hand=described, most_n=10.0, gap_m=(0.0, 0.1))
    result, feedback = GripperAction.result, GripperAction.feedback
    _fields, _ends = GripperAction._fields, GripperAction._ends

    def __init__(self, gap_m, ended):
        self.gap_m, self.how, self.is_held = gap_m, ended, True
        self.motions = self.claim = self

    def release(self):
        self.is_held = False

    def look(self, joints):
        fields = dict.fromkeys(("velocity", "setpoint", "effort_ratio"), np.array([0.0]))
        return JointView(stamp_ns=0, position=np.array([self.gap_m]), **fields)

    def ended(self, motion_id):
        return Ended(status=self.how, reason="") if self.how else None

    def cancel(self, motion_id):
        pass

    forget = cancel

told = []
for gap_m, ended, asked in json.loads(sys.argv[1]):
    hand = Hand(gap_m, ended)
    gripping = Gripping(hand, lambda message: None, 1, 0.05, 0)
    outcome = gripping.step(1)
    if asked:
        outcome = gripping.cancel("enough", superseded=asked == "superseded")
    told.append([outcome and outcome.ending.value, hand.is_held])
print(json.dumps(told))
"""
# Gap in m where 0.05 is wanted, how the motion ended, what is asked: how the goal ends, is it held.
CASES = {
    (0.05, "done", ""): ("succeed", False),
    (0.05, "refused", ""): ("abort", False),
    (0.02, "done", ""): (None, True),  # it settles
    (0.02, "done", "cancelled"): ("canceled", False),
    (0.02, "done", "superseded"): ("canceled", True),
    (0.02, "", "cancelled"): (None, True),  # control brings it to rest first
}


def test_a_hand_is_given_back(ros_graph) -> None:
    told = ros_graph.run(GRIP, json.dumps(list(CASES)))
    assert [tuple(one) for one in told] == list(CASES.values())
