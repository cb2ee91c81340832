"""`vla-deploy agent`: a person grants and takes back what agents may do."""

import pytest

from vla_deploy.client.access.audit_log import AUDIT_FILE, AuditFile
from vla_deploy.runtime.state_dir import access_dir_of


def test_a_lease_is_granted_shown_and_taken_back(vla, run_dir, base):
    assert "agents may read and stop, no more: nobody has leased" in vla("agent", "status").out
    assert "for 5 min 0 s, by leave of cli:" in vla("agent", "lease", "--minutes", 5).out
    assert vla("agent", "status", "--json").document["may_act"] is True
    assert vla("agent", "revoke", "--json").document["rule"] == "lease_revoked"
    entries = AuditFile(access_dir_of(base) / AUDIT_FILE).newest(9)
    assert [(one["act"], one["way"]) for one in entries] == [
        ("agent revoke", "cli"),
        ("agent lease", "cli"),
    ]
    assert entries[1]["details"] == {"minutes": 5.0}


@pytest.mark.parametrize("minutes", ["0", "-1", "61", "nan", "inf", "soon"])
def test_a_lease_lasts_an_hour_at_most(vla, run_dir, capsys, minutes):
    with pytest.raises(SystemExit) as refused:
        vla("agent", "lease", "--minutes", minutes)
    assert refused.value.code == 2
    assert "expected minutes from 0.1 to 60" in capsys.readouterr().err
