import socket

import pytest

from vla_deploy.model_servers.calls.privacy import check_address, check_privacy, resolve
from vla_deploy.model_servers.chat import Chat, ChatMessage
from vla_deploy.model_servers.errors import PrivacyRefused, ServerUnreachable, TimedOut

TEXT = Chat(messages=(ChatMessage(text="hello"),))
IMAGE = Chat(messages=(ChatMessage(text="what is it?", images=(b"jpeg",)),))
REMOTE = {"location": "remote", "vision": True}
TEXT_ONLY = {**REMOTE, "allow_text_off_robot": True}


@pytest.mark.parametrize(
    ("declared", "chat", "refused"),
    [
        ({"vision": True}, IMAGE, None),
        (REMOTE, TEXT, "allow_text_off_robot"),
        (REMOTE, IMAGE, "allow_text_off_robot"),
        (TEXT_ONLY, TEXT, None),
        (TEXT_ONLY, IMAGE, "allow_images_off_robot"),
        ({**TEXT_ONLY, "allow_images_off_robot": True}, IMAGE, None),
    ],
)
def test_text_and_images_leave_the_robot_only_where_each_is_allowed(
    settings, declared, chat, refused
):
    server = settings("https://example.org", **declared)
    if refused is None:
        check_privacy("cloud", server, chat)
        return
    with pytest.raises(PrivacyRefused, match=f"nothing was sent.*servers.cloud.{refused} = true"):
        check_privacy("cloud", server, chat)


@pytest.mark.parametrize(
    ("address", "may"),
    [
        ("127.0.0.1", True),
        ("127.8.8.8", True),
        ("::1", True),
        ("::ffff:127.0.0.1", True),
        ("192.168.1.5", False),
        ("169.254.169.254", False),
        ("0.0.0.0", False),
        ("8.8.8.8", False),
        ("::ffff:8.8.8.8", False),
        ("fe80::1%eth0", False),
    ],
)
def test_a_local_server_is_on_this_computer(settings, address, may):
    if may:
        check_address(settings("http://inference:9"), address)
        return
    with pytest.raises(PrivacyRefused, match=r"inference is at .*nothing was sent"):
        check_address(settings("http://inference:9"), address)


@pytest.mark.parametrize(
    ("url", "address", "may"),
    [
        ("https://api.example", "93.184.216.34", True),
        ("http://api.example", "93.184.216.34", False),
        ("http://nas.local", "192.168.1.5", True),
        ("http://nas.local", "fd00::5", True),
    ],
)
def test_a_public_server_is_reached_by_an_encrypted_way_only(settings, url, address, may):
    declared = settings(url, location="remote", allow_text_off_robot=True)
    if may:
        check_address(declared, address)
        return
    with pytest.raises(PrivacyRefused, match="in the clear"):
        check_address(declared, address)


def test_a_literal_address_is_not_looked_up(monkeypatch):
    monkeypatch.setattr(socket, "getaddrinfo", None)
    assert resolve("127.0.0.1", 9, 1.0) == ("127.0.0.1",)
    assert resolve("::1", 9, 1.0) == ("::1",)


def test_this_computer_s_name_is_on_loopback():
    assert set(resolve("localhost", 9, 5.0)) <= {"127.0.0.1", "::1"}


def test_a_resolver_that_hangs_costs_no_more_than_its_time(monkeypatch):
    import threading

    released = threading.Event()
    monkeypatch.setattr(socket, "getaddrinfo", lambda *_, **__: released.wait(10.0) and [])
    with pytest.raises(TimedOut, match="name server"):
        resolve("slow.example", 9, 0.02)
    released.set()


@pytest.mark.parametrize("host", ["no-such-host.invalid", "x" * 70 + ".example"])
def test_an_unknown_host_is_unreachable(monkeypatch, host):
    real = socket.getaddrinfo

    def offline(name, *rest, **options):
        if len(name) > 63:
            return real(name, *rest, **options)  # refused before anyone is asked
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", offline)
    with pytest.raises(ServerUnreachable) as found:
        resolve(host, 9, 2.0)
    assert not found.value.was_sent
