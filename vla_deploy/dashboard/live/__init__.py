"""Bring the robot's topics to browsers as they change."""

from vla_deploy.dashboard.live.feed import Feed
from vla_deploy.dashboard.live.hub import LiveHub
from vla_deploy.dashboard.live.message import Message, Moment, json_message
from vla_deploy.dashboard.live.part import live

__all__ = ["Feed", "LiveHub", "Message", "Moment", "json_message", "live"]
