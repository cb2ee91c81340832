import pytest

from vla_deploy.model_servers.errors import ServersFileInvalid
from vla_deploy.model_servers.settings import Api, read_servers

GOOD = """
[servers.bench]
api = "openai_compatible"
url = "http://127.0.0.1:8080/v1/"
model = "qwen3-vl-4b"
location = "local"
vision = true
total_timeout_s = 20

[servers.cloud]
api = "anthropic"
url = "https://api.anthropic.com"
model = "claude-haiku-4-5"
location = "remote"
credential = "anthropic_api_key"
allow_text_off_robot = true
"""


@pytest.fixture
def read(tmp_path):
    def read(text: str):
        file = tmp_path / "servers.toml"
        file.write_text(text)
        return read_servers(file)

    return read


def test_declared_servers_are_read_by_name(read):
    servers = read(GOOD)
    assert list(servers) == ["bench", "cloud"]
    assert servers["bench"].url == "http://127.0.0.1:8080/v1"
    assert servers["bench"].total_timeout_s == 20
    assert servers["cloud"].api is Api.ANTHROPIC


def test_nothing_is_allowed_off_the_robot_unless_it_is_written(read):
    server = read(GOOD.replace("allow_text_off_robot = true", ""))["cloud"]
    assert (server.allow_text_off_robot, server.allow_images_off_robot) == (False, False)


def test_no_file_declares_no_server(tmp_path):
    assert read_servers(tmp_path / "servers.toml") == {}


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (('api = "anthropic"', 'api = "gpt"'), "servers.cloud.api: .*got 'gpt'"),
        (('location = "local"', 'location = "robot"'), "servers.bench.location"),
        (('location = "local"', ""), "servers.bench.location: Field required"),
        (("total_timeout_s = 20", "total_timeout_s = 0"), "servers.bench.total_timeout_s: .*got 0"),
        (("total_timeout_s = 20", 'total_timeout_s = "20"'), "valid number, got '20'"),
        (("vision = true", "visoin = true"), "servers.bench.visoin"),
        (("vision = true", "allow_text_off_robot = true"), "a local server is on the robot"),
        (("[servers.cloud]", "[servers.'Cloud 9']"), "small letters"),
        (("[servers.cloud]", "[server.cloud]"), "server: unknown, expected servers"),
        (("https://api", "ftp://api"), "servers.cloud.url: expected http"),
        (("https://api", "https://me:secret@api"), "servers.cloud.url: expected no user"),
        (("anthropic.com", "anthropic.com/v1"), "expected it without /v1"),
        (("127.0.0.1:8080", "127.0.0.1:80800"), "servers.bench.url"),
        (("allow_text_off_robot", "allow_images_off_robot"), "expected allow_text_off_robot too"),
    ],
)
def test_a_fault_is_told_with_its_place(read, change, told):
    with pytest.raises(ServersFileInvalid, match=told):
        read(GOOD.replace(*change))


def test_all_faults_are_told_at_once_and_nothing_that_may_be_a_key(read):
    text = GOOD.replace("api.anthropic.com", "user:sk-secret@api.anthropic.com").replace(
        '"anthropic_api_key"', '"sk-ant-SECRET"'
    )
    with pytest.raises(ServersFileInvalid) as refused:
        read(text.replace("vision = true", "vision = 1"))
    assert len(refused.value.faults) == 3
    assert "secret" not in str(refused.value).lower()


@pytest.mark.parametrize("text", ["[servers", "servers = 3", "\x00"])
def test_what_is_no_declaration_is_an_error(read, text):
    with pytest.raises(ServersFileInvalid, match=r"servers\.toml"):
        read(text)
