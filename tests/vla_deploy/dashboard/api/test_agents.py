"""The lease of AI agents over HTTP."""

import pytest

from tests.vla_deploy.dashboard.conftest import Dashboard


def test_an_admin_grants_a_lease_and_an_operator_takes_it_back(dashboard: Dashboard) -> None:
    assert dashboard.get("agents/lease")["rule"] == "not_leased"
    granted = dashboard.post("agents/lease", 200, {"minutes": 5})
    assert (granted["may_act"], granted["left_s"]) == (True, 300.0)
    assert dashboard.get("agents/lease")["may_act"] is True
    assert dashboard.post("agents/revoke", 200)["rule"] == "lease_revoked"


@pytest.mark.parametrize("minutes", [0, -1, 60.1, "long", 1e400])
def test_a_lease_lasts_an_hour_at_most(dashboard: Dashboard, minutes: object) -> None:
    dashboard.post("agents/lease", 422, {"minutes": minutes if minutes != 1e400 else "inf"})
    assert dashboard.get("agents/lease")["may_act"] is False
