"""Find the furniture of a place, or the nearest: things are put nowhere else."""

import math

from vla_deploy.planning.knowledge import World
from vla_deploy.planning.symbolic.state import Point


def nearest_furniture(spot: Point | None, world: World) -> str | None:
    """Return the place with something to put things on that is nearest, or None."""
    names = [name for name in world.sites if is_surface(name, world)]
    if spot is None:
        return names[0] if names else None
    poses = {name: world.sites[name].pose for name in names}
    return min(
        names,
        key=lambda name: math.dist(spot, (poses[name].x_m, poses[name].y_m)),
        default=None,
    )


def is_surface(name: str, world: World) -> bool:
    """Tell whether one stands before furniture at a place itself, not elsewhere in the room."""
    site = world.sites.get(name)
    return site is not None and site.pose in site.viewpoints


def surface_of(name: str, world: World) -> str:
    """Return the furniture that putting something "in the kitchen" means, or the place itself."""
    site = world.sites.get(name)
    if site is None or not site.viewpoints or is_surface(name, world):
        return name
    return next(
        (one for one, other in world.sites.items() if other.pose == site.viewpoints[0]), name
    )
