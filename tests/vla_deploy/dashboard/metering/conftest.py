"""Ask the dashboard from another host."""

from typing import Any

import pytest
from starlette.testclient import TestClient


@pytest.fixture
def stranger(dashboard: Any) -> TestClient:
    return TestClient(dashboard.app, "http://127.0.0.1:8088", client=("192.0.2.7", 50_000))
