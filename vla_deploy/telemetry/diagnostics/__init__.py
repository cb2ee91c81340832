"""The metrics in the form of ROS 2's diagnostics."""

from vla_deploy.telemetry.diagnostics.array import Level, diagnostics

__all__ = ["Level", "diagnostics"]
