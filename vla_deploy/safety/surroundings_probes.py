"""Find each cause that lies around the robot or in its pose: one pure function per cause."""

import math

import numpy as np

from vla_deploy.robots.protection import ZoneKind, ZoneSource
from vla_deploy.safety.findings import Finding, Probe, first_joint, stale
from vla_deploy.safety.inputs import SafetyInputs, SafetyLimits
from vla_deploy.safety.surroundings import Clearance, Surroundings, ZoneFinding

NEVER_SEEN = math.inf


def stale_scan(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a base that moves while its lidar has told nothing for too long, or nothing ever."""
    if not limits.scan_required:
        return None
    return _silent("scan", inputs, inputs.surroundings.scan_age_s, limits.scan_age_s)


def stale_depth(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a base that moves while its depth camera has told nothing for too long, or ever."""
    around = inputs.surroundings
    limit_s = max(limits.depth_age_s, around.depth_due_s)
    return _silent("near_obstacles", inputs, around.depth_age_s, limit_s)


def stale_pose(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a base that moves while nobody has told where it is for too long, or ever."""
    return _silent("pose", inputs, inputs.surroundings.pose_age_s, limits.pose_age_s)


def stale_imu(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a base that moves while its IMU has told nothing for too long, or nothing ever."""
    return _silent("imu", inputs, inputs.surroundings.imu_age_s, limits.imu_age_s)


def in_zone(kind: ZoneKind) -> Probe:
    """Return the probe that finds something in the zones of one kind."""

    def probe(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
        """Find the nearest of them, with what all of them allow."""
        around = inputs.surroundings
        zones = [zone for zone in around.zones if zone.kind is kind]
        if not zones:
            return None
        nearest = min(zones, key=lambda zone: zone.measured)
        return Finding(
            subject=nearest.name,
            measured=nearest.measured,
            limit=nearest.limit,
            age_s=_seen_age_s(nearest, around),
            speed_ratio=min(zone.speed_ratio for zone in zones),
            blocked=frozenset().union(*(zone.blocked for zone in zones)),
        )

    return probe


def keep_out(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a base that stands deeper in a keep-out area than allowed."""
    around = inputs.surroundings
    area = around.keep_out
    if area is None or area.depth_m <= limits.keep_out_depth_m:
        return None
    return Finding(
        subject=area.name,
        measured=area.depth_m,
        limit=limits.keep_out_depth_m,
        age_s=_told_age_s(around.pose_age_s),
        blocked=frozenset(area.blocked),
    )


def workspace(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a group that is outside the workspace and still on its way out."""
    excess = inputs.surroundings.workspace
    if excess is None or not _moves_by_itself(inputs):
        return None
    if excess.excess_m <= limits.workspace_excess_m or excess.rate_m_s <= limits.approach_m_s:
        return None
    return Finding(
        subject=excess.subject,
        measured=excess.excess_m,
        limit=limits.workspace_excess_m,
        age_s=_joints_age_s(inputs),
    )


def self_collision(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find two parts of the robot that are too close and come closer."""
    pair = inputs.surroundings.self_clearance if _moves_by_itself(inputs) else None
    return _too_close(pair, limits.self_clearance_m, inputs, limits)


def environment_collision(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a part of the robot that is too close to something around it and comes closer."""
    pair = inputs.surroundings.environment_clearance if _moves_by_itself(inputs) else None
    return _too_close(pair, limits.environment_clearance_m, inputs, limits)


def tip_over(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a robot whose margin against tipping over is used up but for the rest it must keep."""
    around = inputs.surroundings
    margin = around.tip_margin_ratio
    if margin is None or margin >= limits.tip_margin_ratio:
        return None
    return Finding(
        subject="balance",
        measured=margin,
        limit=limits.tip_margin_ratio,
        age_s=_told_age_s(around.imu_age_s),
    )


def tip_margin(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a robot that has used up so much of that margin that its base must go slower.

    Where nothing but the rest is left that it must keep, its speed is 0.
    """
    around = inputs.surroundings
    margin, slow_below = around.tip_margin_ratio, limits.tip_slow_below_ratio
    way = slow_below - limits.tip_margin_ratio
    if margin is None or margin >= slow_below or way <= 0.0:
        return None
    return Finding(
        subject="balance",
        measured=margin,
        limit=slow_below,
        age_s=_told_age_s(around.imu_age_s),
        speed_ratio=max(0.0, (margin - limits.tip_margin_ratio) / way),
    )


def collision(inputs: SafetyInputs, limits: SafetyLimits) -> Finding | None:
    """Find a powered joint that something outside the robot pushes harder than allowed."""
    torque = inputs.surroundings.external_torque_nm
    if torque is None:
        return None
    push = np.abs(torque)
    pushed = (push > limits.external_torque_nm) & inputs.torque_enabled
    return first_joint(pushed, push, limits.external_torque_nm, inputs.sample_age_s, limits)


def _moves_by_itself(inputs: SafetyInputs) -> bool:
    """Return whether every joint has come under power: before that, limp arms may lie anywhere.

    One that lets go later does not hide what the others do.
    """
    return inputs.energised and 0 not in inputs.powered.tobytes()


def _too_close(
    pair: Clearance | None, allowed_m: float, inputs: SafetyInputs, limits: SafetyLimits
) -> Finding | None:
    if pair is None or pair.closing_m_s <= limits.approach_m_s:
        return None
    least_m = min(allowed_m, pair.least_m)
    if pair.distance_m >= least_m:
        return None
    return Finding(
        subject=f"{pair.first} and {pair.second}",
        measured=pair.distance_m,
        limit=least_m,
        age_s=_joints_age_s(inputs),
    )


def _silent(
    subject: str, inputs: SafetyInputs, age_s: float | None, limit_s: float
) -> Finding | None:
    """Find a sense that a moving base is without; what never told anything is infinitely old."""
    return stale(subject, _told_age_s(age_s) if inputs.base_moving else None, limit_s)


def _joints_age_s(inputs: SafetyInputs) -> float:
    """Return the age of what is known by the pose of all joints."""
    return float(inputs.sample_age_s.max())


def _seen_age_s(zone: ZoneFinding, around: Surroundings) -> float:
    """Return the age of the oldest of what a zone is judged by."""
    ages_s = {ZoneSource.LIDAR: around.scan_age_s, ZoneSource.DEPTH: around.depth_age_s}
    return max(_told_age_s(ages_s[source]) for source in zone.sources)


def _told_age_s(age_s: float | None) -> float:
    return NEVER_SEEN if age_s is None else age_s
