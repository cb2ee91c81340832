import os
from collections.abc import Iterator

import pytest

from sim_twin.harness.processes import ProcessStack


@pytest.fixture(scope="package")  # two robots in one domain would answer each other's callers
def robot(
    ros_environment: object,
    ros_domain: int,
    tmp_path_factory: pytest.TempPathFactory,
    coarse: str,
) -> Iterator[ProcessStack]:
    before = os.environ.get("ROS_DOMAIN_ID")
    os.environ["ROS_DOMAIN_ID"] = str(ros_domain)
    stack = ProcessStack(tmp_path_factory.mktemp("ros"), "--ros", "--profile", coarse)
    try:
        stack.wait_until_armed()
        # A robot without its gateway would carry on, and each test wait for it in vain.
        assert stack.wait_until(lambda: stack.row("ros")["state"] == "ready")
        yield stack
    finally:
        stack.close()
        if before is None:
            del os.environ["ROS_DOMAIN_ID"]
        else:
            os.environ["ROS_DOMAIN_ID"] = before
