import json

import pytest

from vla_deploy.runtime.state_dir import config_dir_of

SERVER = """
[servers.bench]
api = "openai_compatible"
url = "{url}"
model = "tiny"
location = "{location}"
vision = true
max_attempts = 1
"""


@pytest.fixture
def vla(vla, base, loopback):
    """Run one command line with a declared server."""
    file = config_dir_of(base) / "servers.toml"
    file.parent.mkdir()

    def with_server(*words: str, location: str = "local", extra: str = ""):
        file.write_text(SERVER.format(url=loopback.url, location=location) + extra)
        return vla("servers", *words)

    return with_server


def test_servers_are_listed_with_what_they_may_be_told(vla):
    code, out, _ = vla("list", "--json", extra='credential = "bench_key"')
    row = json.loads(out)["servers"][0]
    assert code == 0
    assert (row["name"], row["may_be_told"], row["key"]) == ("bench", "text images", "missing")
    assert json.loads(vla("list", "--json", location="remote")[1])["servers"][0]["may_be_told"] == (
        "nothing"
    )
    assert "bench" in vla("list")[1]


def test_a_check_tells_reach_model_and_sight(vla, loopback):
    seen = loopback.says('{"colour": "red"}')
    loopback.then(loopback.sends(200, {"data": [{"id": "tiny"}]}), seen)
    code, out, _ = vla("check", "--ask")
    assert code == 0
    assert out.startswith("ok   bench: reached in ")
    assert "has the model, answers, sees" in out


def test_a_check_fails_where_the_model_is_missing(vla, loopback):
    loopback.then(loopback.sends(200, {"data": []}))
    code, out, _ = vla("check", "--json")
    assert code == 1
    assert json.loads(out)[0]["has_model"] is False


def test_a_missing_key_is_told(vla):
    code, out, _ = vla("check", extra='credential = "bench_key"')
    assert (code, "no key bench_key" in out) == (1, True)


def test_faults_of_the_file_end_in_one_message_and_code_2(vla):
    code, _, errors = vla("list", extra="visoin = true")
    assert code == 2
    assert "servers.bench.visoin" in errors
