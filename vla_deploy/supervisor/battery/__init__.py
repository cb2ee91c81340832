"""Measure the battery, judge whether it is low, and publish both."""

from vla_deploy.supervisor.battery.keeper import BatteryKeeper, open_battery

__all__ = ["BatteryKeeper", "open_battery"]
