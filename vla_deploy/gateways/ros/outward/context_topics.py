"""Publish the robot's state, its surroundings and what it does, as planning nodes read them."""

from collections.abc import Mapping
from typing import Any, Final

from vla_deploy.client.activity import RobotActivity
from vla_deploy.gateways.ros.conversions import quaternion_of
from vla_deploy.gateways.ros.geometry import pose_of
from vla_deploy.gateways.ros.graph import JsonTopic
from vla_deploy.gateways.ros.outward.plan_dialects import ranked_name
from vla_deploy.gateways.ros.outward.plan_state import PlanState, plan_state_of
from vla_deploy.gateways.ros.outward.scene import Locator, described, latest_last
from vla_deploy.gateways.ros.part import Due, Gateway, GatewayPart
from vla_deploy.ipc import topics
from vla_deploy.robots.maps.map_file import MapFile

STATE: Final = "/robot/state"
CONTEXT: Final = "/environment/context"
PLAN_STATUS: Final = "/cognitive_planner/status"
CAPSTONE: Final = "/capstone/status"
STATE_HZ: Final = 1.0
STATUS_HZ: Final = 2.0
LOOK_HZ: Final = 10.0
"""How often a change of a status is looked for."""
_AGE_S: Final = 1.0
_STATUS_AGE_S: Final = 2.0
_ACTIVITY_AGE_S: Final = 3.0
_LOST: Final = 2


class ContextTopics(GatewayPart):
    """Publish /robot/state and /environment/context every second, two statuses also on change."""

    def __init__(self, gateway: Gateway, locator: Locator, file: MapFile | None) -> None:
        graph = gateway.graph
        self._gateway = gateway
        self._locator = locator
        self._state = JsonTopic(graph, STATE)
        self._context = JsonTopic(graph, CONTEXT)
        self._plan = JsonTopic(graph, PLAN_STATUS)
        self._capstone = JsonTopic(graph, CAPSTONE)
        self._bounds = _map_bounds(file)
        self._due = Due(STATE_HZ)
        self._status_due = Due(STATUS_HZ)
        self._look_due = Due(LOOK_HZ)
        self._published: tuple[Any, ...] = ()

    def step(self, now_ns: int) -> None:
        """Publish what is due or new."""
        if self._due.is_now(now_ns):
            state = self._robot_state()
            self._state.publish(state)
            self._context.publish(self._surroundings(state))
        if not self._look_due.is_now(now_ns):
            return
        activity, plan = self._activity(), self._plan_state()
        commands = self._gateway.commands
        key = (activity, plan, tuple(commands.current.statuses.values()))
        if key != self._published or self._status_due.is_now(now_ns):
            self._published = key
            self._publish_statuses(activity, plan)

    def stop(self) -> None:
        """Publish last that the robot is out of reach."""
        self._publish_statuses(RobotActivity.STOPPED, PlanState.IDLE)

    def _activity(self) -> RobotActivity:
        """Return what the supervisor says; a robot without one is on its way down."""
        told = self._gateway.link.document(topics.ACTIVITY, _ACTIVITY_AGE_S)
        return RobotActivity.STOPPED if told is None else RobotActivity(told["activity"])

    def _plan_state(self) -> PlanState:
        link, commands = self._gateway.link, self._gateway.commands
        return plan_state_of(
            self._gateway.control_status(),
            link.document(topics.EXECUTOR_STATUS, _AGE_S),
            link.document(topics.PLANNER_STATUS, _STATUS_AGE_S),
            has_succeeded=commands.has_succeeded,
        )

    def _publish_statuses(self, activity: RobotActivity, plan: PlanState) -> None:
        commands = self._gateway.commands
        state = activity.value.upper()
        self._capstone.publish_text(f"State: {state}, Tasks: {commands.actions_left}")
        statuses = list(commands.current.statuses.values())
        index = next((i for i, one in enumerate(statuses) if one in ("active", "pending")), 0)
        self._plan.publish(
            {
                "status": plan,
                "current_action_index": index,
                "total_actions": len(statuses),
                "robot_state": self._brief(),
            }
        )

    def _brief(self) -> dict[str, Any]:
        """Return the state that goes with a plan: place, gripper, what is held, battery."""
        sample = self._gateway.link.fresh(topics.POSE, _AGE_S)
        executor = self._gateway.link.document(topics.EXECUTOR_STATUS, _AGE_S)
        held = [one for one in executor["holding"].values() if one] if executor else []
        pose = None if sample is None else pose_of(sample)
        place = "" if pose is None else self._locator.place_at(pose.x_m, pose.y_m)
        return {
            "location": place or "unknown",
            "gripper_state": "closed" if held else "open",
            "held_object": held[0] if held else None,
            "battery": self._battery_percent(),
        }

    def _battery_percent(self) -> float | None:
        """Return the charge in per cent, as planning nodes read it; None where it is not known."""
        charge = (self._gateway.battery() or {}).get("charge_ratio")
        return None if charge is None else round(100.0 * float(charge), 1)

    def _robot_state(self) -> dict[str, Any]:
        gateway, commands = self._gateway, self._gateway.commands
        position, orientation = self._place()
        scene = self._locator.scene() or {}
        hands = gateway.robot.hands.values()
        return {
            "position": position,
            "orientation": orientation,
            "detected_objects": [described(one) for one in latest_last(scene.get("objects", ()))],
            "available_tools": [hand.gripper for hand in hands],
            "battery_level": self._battery_percent(),
            "current_task": commands.current.text,
            "recent_actions": [self._recent(one) for one in commands.recent],
            **self._brief(),
        }

    def _recent(self, action: Mapping[str, Any]) -> dict[str, Any]:
        given = action["parameters"] or {}
        name, parameters = ranked_name(str(action["skill"]), given, self._locator.where)
        return {
            "action_type": name,
            "parameters": parameters,
            "status": action["status"],
            "execution_time": action["execution_time_s"],
            "error": action["error"],
        }

    def _place(self) -> tuple[list[float] | None, list[float] | None]:
        """Return x, y, z in m of the map and a quaternion x, y, z, w; None for a lost robot."""
        sample = self._gateway.link.fresh(topics.POSE, _AGE_S)
        if sample is None or int(sample.data["state"]) >= _LOST:
            return None, None
        pose = pose_of(sample)
        turned = quaternion_of(pose.yaw_rad)
        return [pose.x_m, pose.y_m, 0.0], [turned.x, turned.y, turned.z, turned.w]

    def _surroundings(self, state: Mapping[str, Any]) -> dict[str, Any]:
        scene = self._locator.scene() or {}
        things = state["detected_objects"]
        return {
            "detected_objects": things,
            "object_locations": {one["name"]: one["position"] for one in things},
            "known_locations": self._locator.places(),
            "surfaces": [
                {"name": one.get("name", ""), "height": one["height_m"]}
                for one in scene.get("surfaces", ())
            ],
            "obstacles": [
                {"class": one["class"], "position": list(one["position_m"])}
                for one in scene.get("bystanders", ())
            ],
            "restricted_areas": [
                {"name": zone.name, "reason": zone.reason, "polygon": list(zone.polygon_m)}
                for zone in self._gateway.robot.home.zones
            ],
            "robot_position": state["position"],
            "map_bounds": self._bounds,
        }


def _map_bounds(file: MapFile | None) -> dict[str, float] | None:
    """Return how far the map reaches, in m of its frame."""
    if file is None:
        return None
    height, width = file.shades.shape
    x_m, y_m = file.origin_m
    return {
        "min_x": x_m,
        "min_y": y_m,
        "max_x": round(x_m + width * file.resolution_m, 3),
        "max_y": round(y_m + height * file.resolution_m, 3),
    }
