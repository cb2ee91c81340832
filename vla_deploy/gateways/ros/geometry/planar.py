"""Join poses on the floor: x, y in m, yaw in rad."""

import math

from vla_deploy.ipc import Sample

Planar = tuple[float, float, float]


def planar_of(sample: Sample) -> Planar:
    """Return the pose that a cell holds."""
    data = sample.data
    return float(data["x_m"]), float(data["y_m"]), float(data["yaw_rad"])


def joined(frame: Planar, inner: Planar) -> Planar:
    """Return what lies at `inner` in a frame, seen from where the frame lies."""
    cosine, sine = math.cos(frame[2]), math.sin(frame[2])
    return (
        frame[0] + cosine * inner[0] - sine * inner[1],
        frame[1] + sine * inner[0] + cosine * inner[1],
        frame[2] + inner[2],
    )


def inverse(pose: Planar) -> Planar:
    """Return where the outer frame lies, seen from this one."""
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    return (
        -cosine * pose[0] - sine * pose[1],
        sine * pose[0] - cosine * pose[1],
        -pose[2],
    )
