"""A real server on loopback answers rightly, wrongly, slowly, hugely, elsewhere or not at all."""

import logging
import shutil
import socket
import subprocess
import threading
import time
import traceback

import pytest

from vla_deploy.model_servers.chat import Chat, ChatMessage
from vla_deploy.model_servers.errors import (
    AnswerMalformed,
    AnswerTooLarge,
    CircuitOpen,
    ModelServerError,
    PrivacyRefused,
    ServerFailed,
    ServerRefused,
    ServerUnreachable,
    TimedOut,
)
from vla_deploy.runtime.deadline import Deadline

CHAT = Chat(messages=(ChatMessage(text="hello"),))
PICTURE = Chat(messages=(ChatMessage(text="what is it?", images=(b"jpeg",)),))
KEY = "sk-very-secret-0123456789"


def test_a_right_answer_comes_with_its_cost(loopback, open_server):
    loopback.then(loopback.says("hi"))
    server = open_server(loopback.url, key=KEY)
    assert server.complete(CHAT).text == "hi"
    heard = loopback.heard[0]
    assert (heard.method, heard.path) == ("POST", "/chat/completions")
    assert heard.headers["Authorization"] == f"Bearer {KEY}"
    assert heard.body["messages"] == [{"role": "user", "content": "hello"}]
    told = server.document()
    assert (told["calls"], told["answers"], told["tokens_in"], told["tokens_out"]) == (1, 1, 11, 7)
    assert told["breaker"] == "closed"


def test_a_busy_server_is_asked_again_when_it_wishes(loopback, open_server, clock):
    busy = loopback.sends(429, {"error": {"message": "slow down"}}, Retry_After="1")
    loopback.then(busy, loopback.sends(503, b""), loopback.says("hi"))
    server = open_server(loopback.url, clock=clock, backoff_s=0.2)
    assert server.complete(CHAT).text == "hi"
    assert clock.waits_s == [1.0, 0.2]
    assert server.document()["retries"] == 2


def test_a_date_to_wait_for_counts_from_the_reply_s_own_date(loopback, open_server, clock):
    dates = {
        "Retry_After": "Wed, 21 Oct 2026 07:28:01 GMT",
        "Date": "Wed, 21 Oct 2026 07:28:00 GMT",
    }

    def busy(handler):
        handler.date_time_string = lambda: dates["Date"]
        loopback.sends(503, b"", Retry_After=dates["Retry_After"])(handler)

    loopback.then(busy, loopback.says("hi"))
    assert open_server(loopback.url, clock=clock).complete(CHAT).text == "hi"
    assert clock.waits_s == [1.0]


def test_a_server_that_wants_more_time_than_there_is_is_given_up_at_once(
    loopback, open_server, clock
):
    loopback.then(loopback.sends(429, {"error": {"message": "slow down"}}, Retry_After="60"))
    with pytest.raises(ServerFailed, match="429: slow down") as failed:
        open_server(loopback.url, clock=clock).complete(CHAT)
    assert (failed.value.wait_s, clock.waits_s, len(loopback.heard)) == (60.0, [], 1)


@pytest.mark.parametrize(
    ("status", "said", "told"),
    [
        (400, {"error": {"message": "no such field"}}, "HTTP 400: no such field"),
        (401, {"error": {"message": f"wrong key {KEY}"}}, r"HTTP 401: it refuses the key"),
        (404, {"error": "model not found"}, r"HTTP 404: model not found; look at url and model"),
        (422, {"detail": "bad"}, "HTTP 422: bad"),
        (429, {"error": {"code": "insufficient_quota", "message": "pay"}}, "HTTP 429: pay"),
        (
            429,
            {
                "error": {
                    "type": "rate_limit_error",
                    "details": {"error_code": "enforced_spend_limit_reached"},
                }
            },
            "HTTP 429",
        ),
    ],
)
def test_what_waiting_does_not_mend_is_not_tried_again(
    loopback, open_server, clock, status, said, told
):
    loopback.then(loopback.sends(status, said))
    with pytest.raises(ServerRefused, match=told):
        open_server(loopback.url, clock=clock, key=KEY).complete(CHAT)
    assert len(loopback.heard) == 1


def test_a_redirect_is_not_followed(loopback, open_server):
    other = "http://u:p@elsewhere.example/v1?token=1"
    loopback.then(loopback.sends(307, b"", Location=other))
    with pytest.raises(
        ServerRefused, match=r"points to http://elsewhere\.example; that"
    ) as refused:
        open_server(loopback.url).complete(CHAT)
    assert "token" not in str(refused.value)
    assert len(loopback.heard) == 1


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"<html>gateway</html>",
        b"[1, 2]",
        b"\xff\xfe",
        b'{"choices": ',
        b"{}",
        b'{"choices": [{}]}',
    ],
)
def test_nonsense_is_malformed(loopback, open_server, content):
    loopback.then(loopback.sends(200, content))
    with pytest.raises(AnswerMalformed):
        open_server(loopback.url).complete(CHAT)


def test_a_compressed_answer_that_nobody_asked_for_is_malformed(loopback, open_server):
    loopback.then(loopback.sends(200, b"\x1f\x8b", Content_Encoding="gzip"))
    with pytest.raises(AnswerMalformed, match="gzip"):
        open_server(loopback.url).complete(CHAT)
    assert loopback.heard[0].headers["Accept-Encoding"] == "identity"


def test_a_huge_answer_is_cut_off(loopback, open_server):
    loopback.then(loopback.sends(200, b" " * 3_000_000))
    with pytest.raises(AnswerTooLarge, match="at most 16 KB"):
        open_server(loopback.url, max_answer_bytes=16_384).complete(CHAT)


def test_endless_headers_are_cut_off(loopback, open_server):
    loopback.then(loopback.raw(b"HTTP/1.1 200 OK\r\n" + b"X: y\r\n" * 100_000))
    with pytest.raises(ServerUnreachable, match="no whole HTTP answer"):
        open_server(loopback.url).complete(CHAT)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"this is no HTTP\r\n\r\n",
        b"HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\n{",
        b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n5\r\n{",
    ],
)
def test_a_server_that_goes_in_mid_answer_is_not_asked_twice(loopback, open_server, clock, content):
    loopback.then(loopback.raw(content))
    with pytest.raises(ServerUnreachable) as gone:
        open_server(loopback.url, clock=clock).complete(CHAT)
    assert gone.value.was_sent
    assert len(loopback.heard) == 1


def test_a_silent_server_costs_the_read_time_out(loopback, open_server):
    loopback.then(lambda handler: handler.connection.recv(1))
    began = time.monotonic()
    with pytest.raises(TimedOut, match=r"silent for 0\.1 s"):
        open_server(loopback.url, read_timeout_s=0.1).complete(CHAT)
    assert time.monotonic() - began < 1.0


def test_an_answer_that_drips_costs_the_total_time_out(loopback, open_server):
    head = b"HTTP/1.1 200 OK\r\nContent-Length: 1000\r\n\r\n"
    loopback.then(loopback.raw(head, *[b" "] * 100, pause_s=0.02))
    began = time.monotonic()
    with pytest.raises(TimedOut):
        open_server(loopback.url, read_timeout_s=1.0, total_timeout_s=0.2).complete(CHAT)
    assert time.monotonic() - began < 1.0


def test_headers_that_drip_cost_the_total_time_out(loopback, open_server):
    loopback.then(loopback.raw(b"HTTP/1.1 200 OK\r\n", *[b"X: y\r\n"] * 100, pause_s=0.02))
    with pytest.raises(TimedOut):
        open_server(loopback.url, read_timeout_s=1.0, total_timeout_s=0.2).complete(CHAT)


def test_a_refused_connection_is_tried_again_and_then_told(open_server, clock):
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{unused.getsockname()[1]}"
        with pytest.raises(ServerUnreachable, match="refused") as found:
            open_server(url, clock=clock, max_attempts=3, draw=lambda: 0.1).complete(CHAT)
    assert not found.value.was_sent
    assert clock.waits_s == pytest.approx([0.05, 0.1])


def test_the_next_address_is_tried_where_the_first_refuses(loopback, open_server):
    loopback.then(loopback.says("hi"))
    server = open_server(
        loopback.url.replace("127.0.0.1", "bench"),
        resolve=lambda host, port, timeout_s: ("127.0.0.2", "127.0.0.1"),
    )
    assert server.complete(CHAT).text == "hi"


def test_a_local_name_that_leads_away_is_found_before_anything_is_sent(loopback, open_server):
    loopback.then(loopback.says("hi"))
    server = open_server(
        loopback.url.replace("127.0.0.1", "bench"),
        resolve=lambda host, port, timeout_s: ("127.0.0.1", "93.184.216.34"),
    )
    with pytest.raises(PrivacyRefused, match=r"93\.184\.216\.34"):
        server.complete(CHAT)
    assert loopback.heard == []


def test_a_proxy_of_the_environment_is_not_used(loopback, open_server, monkeypatch):
    for name in ("http_proxy", "HTTP_PROXY", "ALL_PROXY"):
        monkeypatch.setenv(name, "http://127.0.0.1:1")
    loopback.then(loopback.says("hi"))
    assert open_server(loopback.url).complete(CHAT).text == "hi"


def test_nothing_is_sent_that_may_not_leave_the_robot(loopback, open_server):
    loopback.then(loopback.says("hi"))
    text_only = {"location": "remote", "allow_text_off_robot": True, "vision": True}
    with pytest.raises(PrivacyRefused, match="text"):
        open_server(loopback.url, location="remote").complete(CHAT)
    with pytest.raises(PrivacyRefused, match="images"):
        open_server(loopback.url, **text_only).complete(PICTURE)
    assert loopback.heard == []
    assert open_server(loopback.url, **text_only).complete(CHAT).text == "hi"


def test_a_model_that_takes_no_images_gets_none(loopback, open_server):
    loopback.then(loopback.says("hi"))
    with pytest.raises(ServerRefused, match="vision = true"):
        open_server(loopback.url).complete(PICTURE)
    assert loopback.heard == []


def test_a_failing_server_is_left_alone_and_tried_again_later(loopback, open_server, clock):
    loopback.then(loopback.sends(500, b""), loopback.sends(500, b""), loopback.says("hi"))
    server = open_server(loopback.url, clock=clock, breaker_failures=2, breaker_open_s=30.0)
    with pytest.raises(ServerFailed):
        server.complete(CHAT)
    with pytest.raises(CircuitOpen, match=r"tried again in 30\.0 s"):
        server.complete(CHAT)
    assert (len(loopback.heard), server.document()["breaker"]) == (2, "open")
    clock.time_ns += 30 * 10**9
    assert server.complete(CHAT).text == "hi"
    assert server.document()["breaker"] == "closed"
    assert server.document()["failures"] == {"ServerFailed": 1, "CircuitOpen": 1}


def test_a_call_that_its_person_called_in_does_not_count_against_the_server(loopback, open_server):
    recall = threading.Event()

    def recalled_meanwhile(handler):
        recall.set()
        handler.connection.recv(1)

    loopback.then(recalled_meanwhile, loopback.says("hi"))
    server = open_server(loopback.url, breaker_failures=1)
    with pytest.raises(TimedOut, match="nobody waits"):
        server.complete(CHAT, deadline=Deadline.within(server.clock, 10.0, recall))
    assert server.document()["breaker"] == "closed"
    assert server.complete(CHAT).text == "hi"


def test_a_call_for_which_no_time_is_left_does_not_count_against_the_server(loopback, open_server):
    loopback.then(loopback.says("hi"))
    server = open_server(loopback.url, breaker_failures=1)
    with pytest.raises(TimedOut, match="no whole answer within"):
        server.complete(CHAT, deadline=Deadline.within(server.clock, 0.0))
    assert (server.document()["breaker"], loopback.heard) == ("closed", [])


def test_a_server_that_is_silent_counts_as_failing(loopback, open_server):
    loopback.then(lambda handler: handler.connection.recv(1))
    server = open_server(loopback.url, breaker_failures=1, read_timeout_s=0.05)
    with pytest.raises(TimedOut):
        server.complete(CHAT, deadline=Deadline.within(server.clock, 10.0, threading.Event()))
    assert server.document()["breaker"] == "open"


def test_calls_beyond_what_is_declared_wait_their_turn(loopback, open_server):
    under_way, most, lock = [0], [0], threading.Lock()
    answer = loopback.says("hi")

    def watched(handler):
        with lock:
            under_way[0] += 1
            most[0] = max(most[0], under_way[0])
        time.sleep(0.02)  # long enough for the others to come
        with lock:
            under_way[0] -= 1
        answer(handler)

    loopback.then(watched)
    server = open_server(loopback.url, max_calls=2, max_waiting=8)
    threads = [threading.Thread(target=server.complete, args=(CHAT,)) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert server.document()["answers"] == 6
    assert most[0] <= 2


def test_a_key_is_in_no_log_and_no_error(loopback, open_server, clock, caplog):
    caplog.set_level(logging.DEBUG)
    echo = loopback.sends(400, {"error": {"message": f"bad header: Bearer {KEY}"}}, X_Echo=KEY[:4])
    loopback.then(echo, loopback.sends(500, {"error": KEY}), loopback.raw(b""), loopback.says("hi"))
    said = []
    server = open_server(loopback.url, clock=clock, key=KEY, max_attempts=1)
    for _ in range(3):
        with pytest.raises(ModelServerError) as error:
            server.complete(CHAT)
        said += traceback.format_exception(error.value)
    server.complete(CHAT)
    said += [str(server.document()), repr(server.settings), repr(vars(server)), caplog.text]
    assert "httpcore2" in caplog.text
    assert [text for text in said if KEY in text] == []


def test_tls_with_a_server_that_speaks_none_is_unreachable(loopback, open_server):
    url = loopback.url.replace("http://", "https://")
    loopback.then(loopback.says("hi"))
    with pytest.raises(ServerUnreachable, match=r"(?i)ssl|tls|record"):
        open_server(url, max_attempts=1).complete(CHAT)


@pytest.fixture
def certificate(tmp_path):
    openssl = shutil.which("openssl")
    if openssl is None:
        pytest.skip("needs openssl to make a certificate")
    files = {"-keyout": tmp_path / "key.pem", "-out": tmp_path / "cert.pem"}
    subprocess.run(
        [
            openssl, "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256",
            "-nodes", "-days", "2", "-subj", "/CN=bench", "-addext", "subjectAltName=DNS:bench",
            *(str(part) for pair in files.items() for part in pair),
        ],
        check=True,
        capture_output=True,
    )  # fmt: skip
    return files["-out"], files["-keyout"]


def test_a_certificate_is_checked_by_the_declared_authority_and_name(
    loopback, open_server, certificate
):
    loopback.secure(*certificate)
    loopback.then(loopback.says("hi"))
    bench, other = (
        loopback.url.replace("http://127.0.0.1", f"https://{n}") for n in ("bench", "other")
    )
    here = {"resolve": lambda host, port, timeout_s: ("127.0.0.1",), "max_attempts": 1}
    with pytest.raises(ServerUnreachable, match="certificate verify failed"):
        open_server(bench, **here).complete(CHAT)
    with pytest.raises(ServerUnreachable, match="certificate verify failed: Hostname mismatch"):
        open_server(other, ca_file=str(certificate[0]), **here).complete(CHAT)
    assert loopback.heard == []
    assert open_server(bench, ca_file=str(certificate[0]), **here).complete(CHAT).text == "hi"


def test_an_authority_s_file_that_is_none_is_told(open_server, tmp_path):
    (tmp_path / "ca.pem").write_text("nothing")
    with pytest.raises(ServerRefused, match=r"ca\.pem"):
        open_server("https://127.0.0.1:9", ca_file=str(tmp_path / "ca.pem")).complete(CHAT)


def test_an_ipv6_address_is_named_with_its_brackets(open_server, loopback):
    heard = []

    def remember(host, port, timeout_s):
        heard.append((host, port))
        return ("127.0.0.1",)

    loopback.then(loopback.says("hi"))
    url = loopback.url.replace("127.0.0.1", "[::1]")
    assert open_server(url, resolve=remember).complete(CHAT).text == "hi"
    assert heard == [("::1", loopback.server.server_port)]
    assert loopback.heard[0].headers["Host"] == f"[::1]:{loopback.server.server_port}"
