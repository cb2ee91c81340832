"""Wait for what an operator's act leads to."""

import asyncio

from drivers.clock import NS_PER_S
from vla_deploy.client.acts import REACHED, Status
from vla_deploy.client.link import RobotLink


async def carried_out(link: RobotLink, act: str, within_s: float) -> tuple[bool, Status | None]:
    """Wait until control shows an act, or the time is over; return its last status, too."""
    end_ns = link.clock.now_ns() + round(within_s * NS_PER_S)
    while True:
        status = link.document("control_status", age_limit_s=1.0)
        if status is not None and REACHED[act](status):
            return True, status
        if link.clock.now_ns() >= end_ns:
            return False, status
        await asyncio.sleep(0.02)
