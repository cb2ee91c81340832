"""Hold the worlds that a robot can be put into."""

from sim_twin.worlds.placement import BodyPose, WorldObject, WorldSpec, draw_poses, load_world

__all__ = ["BodyPose", "WorldObject", "WorldSpec", "draw_poses", "load_world"]
