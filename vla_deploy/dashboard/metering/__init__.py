"""Measure the robot for scrapers, for the history and for whoever asks."""

from vla_deploy.dashboard.metering.part import Metering, metering

__all__ = ["Metering", "metering"]
