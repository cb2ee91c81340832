"""Find the robot that runs now: an agent's process outlives runs."""

from pathlib import Path

from drivers.clock import Clock
from vla_deploy.client.agent_lease import AGENT, LeaseState, judge_lease
from vla_deploy.client.link import RobotLink
from vla_deploy.gateways.mcp.errors import NoRobot
from vla_deploy.ipc import topics
from vla_deploy.supervisor.runs.runtime import running


class RobotAccess:
    """Give the link to the run of one runtime directory; a new run gets a new one.

    It belongs to one thread. `clock` replaces the run's.
    """

    def __init__(self, base: Path, clock: Clock | None = None) -> None:
        self.base = base
        self._clock = clock
        self._link: RobotLink | None = None

    def link(self) -> RobotLink:
        """Return the link to the run of now.

        Raises:
            NoRobot: none runs.
        """
        owner = running(self.base)
        if owner is None:
            raise NoRobot(f"no robot runs in {self.base}; a person starts it: vla-deploy run")
        run_dir = Path(owner.run_dir)
        if self._link is None or self._link.run_dir != run_dir:
            self.close()
            self._link = RobotLink(run_dir, self._clock, source=AGENT)
        return self._link

    def lease(self) -> LeaseState:
        """Return how the run's lease stands.

        Raises:
            NoRobot: none runs.
        """
        link = self.link()
        return judge_lease(link.document(topics.AGENT_LEASE), link.clock.now_ns())

    def close(self) -> None:
        """Let go of the run."""
        if self._link is not None:
            self._link.close()
        self._link = None
