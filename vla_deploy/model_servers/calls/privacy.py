"""Decide what may be told to a server: nothing leaves the robot unless it is configured."""

from vla_deploy.model_servers.chat import Chat
from vla_deploy.model_servers.errors import PrivacyRefused
from vla_deploy.model_servers.settings import ServerSettings


def check_privacy(name: str, settings: ServerSettings, chat: Chat) -> None:
    """Accept what a chat would tell a server.

    Raises:
        PrivacyRefused: the server is not on the robot, and that was not allowed.
    """
    if settings.is_local:
        return
    if not settings.allow_text_off_robot:
        raise PrivacyRefused(_said(name, "text", "allow_text_off_robot"))
    if chat.has_images and not settings.allow_images_off_robot:
        raise PrivacyRefused(_said(name, "images", "allow_images_off_robot"))


def _said(name: str, what: str, key: str) -> str:
    return (
        f"server {name} is not on the robot, and {what} may not leave it; nothing was sent. "
        f"To allow it: servers.{name}.{key} = true"
    )
