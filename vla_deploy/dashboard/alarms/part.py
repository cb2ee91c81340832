"""Make the desk of the alarms of one robot."""

import time
from typing import Final

from fastapi import FastAPI

from vla_deploy.client.link import RobotLink
from vla_deploy.dashboard.alarms.alarm_file import AlarmFile
from vla_deploy.dashboard.alarms.desk import AlarmDesk
from vla_deploy.dashboard.alarms.listening import Listener
from vla_deploy.dashboard.alarms.live_feed import AlarmFeed
from vla_deploy.runtime.state_dir import state_dir_of

_FILE: Final = "dashboard/alarms.json"


def alarm_desk(app: FastAPI) -> AlarmDesk:
    """Return the desk, which routes find as `app.state.alarms`, and make it a live topic."""
    link: RobotLink = app.state.link
    desk = AlarmDesk(
        link.run_dir.resolve().name,
        Listener(link).listen,
        AlarmFile(state_dir_of(link.base) / _FILE),
        link.clock,
        time.time_ns,
    )
    app.state.alarms = desk
    app.state.live.add(AlarmFeed(desk))
    return desk
