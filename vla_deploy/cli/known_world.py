"""Read what the running robot knows of its surroundings, for commands that ask about them."""

from typing import Any, Final

from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.session import Session
from vla_deploy.robots import RobotDescription, load_robot

FRESH_S: Final = 5.0


def told_scene(session: Session) -> dict[str, Any]:
    """Return the scene topic's document.

    Raises:
        UsageError: perception is silent.
    """
    document = session.document("scene", age_limit_s=FRESH_S)
    if document is None:
        raise UsageError("perception tells no scene; see: vla-deploy status")
    return document


def running_robot(session: Session) -> RobotDescription:
    """Return the robot that runs.

    Raises:
        UsageError: the supervisor is silent.
    """
    table = session.document("process_table", age_limit_s=FRESH_S)
    if table is None:
        raise UsageError("the supervisor does not tell which robot this is; see: vla-deploy status")
    return load_robot(table["robot"])
