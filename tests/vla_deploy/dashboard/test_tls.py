import shutil
import socket
import ssl
import subprocess
import threading

import pytest

from vla_deploy.dashboard.errors import TlsUnusable
from vla_deploy.dashboard.tls import server_context


def openssl(*arguments):
    program = shutil.which("openssl")
    if program is None:
        pytest.skip("needs openssl to make a certificate")
    subprocess.run([program, *map(str, arguments)], check=True, capture_output=True)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A certificate and its key, another key, and the first one behind a password."""
    folder = tmp_path_factory.mktemp("tls")
    curve = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256")
    for name in ("robot", "other"):
        files = ("-keyout", folder / f"{name}.key", "-out", folder / f"{name}.pem")
        openssl("req", "-x509", *curve, "-nodes", "-days", "1", "-subj", "/CN=robot", *files)
    locked = ("-out", folder / "locked.key", "-aes256", "-passout", "pass:secret")
    openssl("pkey", "-in", folder / "robot.key", *locked)
    for key in folder.glob("*.key"):
        key.chmod(0o600)
    return folder


def test_certificate_and_key_speak_tls_and_nothing_older(made):
    context = server_context(str(made / "robot.pem"), str(made / "robot.key"))
    ours, theirs = socket.socketpair()
    trusting = ssl.create_default_context(cafile=str(made / "robot.pem"))
    trusting.check_hostname = False
    shake = threading.Thread(
        target=lambda: context.wrap_socket(ours, server_side=True).close(), daemon=True
    )
    shake.start()
    with trusting.wrap_socket(theirs) as secure:
        assert secure.version() in ("TLSv1.2", "TLSv1.3")
    shake.join()
    assert context.minimum_version is ssl.TLSVersion.TLSv1_2


@pytest.mark.parametrize(
    ("certificate", "key", "said"),
    [
        ("missing.pem", "robot.key", "tls_certificate .*No such file"),
        ("robot.pem", "missing.key", "tls_key .*No such file"),
        ("robot.pem", "", "tls_key .*Is a directory"),
        ("robot.pem", "other.key", "belong together"),
        ("robot.pem", "locked.key", "needs a password"),
        ("robot.key", "robot.key", "expected PEM"),
    ],
)
def test_what_is_wrong_with_them_is_said_with_what_to_try(made, certificate, key, said):
    with pytest.raises(TlsUnusable, match=said):
        server_context(str(made / certificate), str(made / key))


def test_a_key_that_everybody_may_read_is_none(made):
    key = made / "open.key"
    key.write_bytes((made / "robot.key").read_bytes())
    key.chmod(0o644)
    with pytest.raises(TlsUnusable, match="chmod 640"):
        server_context(str(made / "robot.pem"), str(key))
