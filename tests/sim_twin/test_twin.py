"""Join the physics to the devices: what a host learns of time."""

from drivers.clock import NS_PER_S
from drivers.lidar.ld19 import Ld19
from sim_twin.lines import MemoryLine
from sim_twin.twin import Twin
from vla_deploy.robots import load_robot

SLOWDOWN = 2


def test_scans_are_young_for_a_host_whose_twin_is_too_slow() -> None:
    robot = load_robot("butler")
    twin = Twin(robot)

    class Host:
        """Whose time passes twice as fast as that of the physics."""

        def now_ns(self) -> int:
            return twin.now_ns + twin.slipped_ns

        def sleep_until(self, deadline_ns: int) -> None:
            while self.now_ns() < deadline_ns:
                before_ns = twin.now_ns
                twin.step()
                twin.slipped_ns += (SLOWDOWN - 1) * (twin.now_ns - before_ns)

    host = Host()
    lidar = Ld19(MemoryLine(twin.lines[robot.lidar.device], host), host)
    ages_ns, end_ns = [], host.now_ns() + 4 * NS_PER_S
    while host.now_ns() < end_ns:
        host.sleep_until(host.now_ns() + NS_PER_S // 50)
        if (scan := lidar.poll()) is not None:
            ages_ns.append(host.now_ns() - scan.stamp_ns)
    assert len(ages_ns) > 30
    assert max(ages_ns) < NS_PER_S // 10
