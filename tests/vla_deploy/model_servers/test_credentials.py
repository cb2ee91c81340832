import copy
import pickle  # noqa: TID251 - to show that a secret does not go this way

import pytest

from vla_deploy.model_servers.credentials import find_credential
from vla_deploy.model_servers.errors import CredentialMissing
from vla_deploy.runtime.secret import Secret

KEY = "sk-very-secret-0123456789"


def test_systemd_s_credential_comes_before_the_environment(tmp_path):
    (tmp_path / "bench_key").write_text(KEY + "\n")
    environment = {"CREDENTIALS_DIRECTORY": str(tmp_path), "BENCH_KEY": "another"}
    assert find_credential("bench_key", environment).reveal() == KEY


def test_the_environment_is_asked_where_systemd_gave_nothing(tmp_path):
    environment = {"CREDENTIALS_DIRECTORY": str(tmp_path), "BENCH_KEY": KEY}
    assert find_credential("bench_key", environment).reveal() == KEY


def test_a_missing_key_is_an_error_that_says_where_to_put_it(tmp_path):
    with pytest.raises(CredentialMissing, match=r"BENCH_KEY.*--credential bench_key=FILE"):
        find_credential("bench_key", {"CREDENTIALS_DIRECTORY": str(tmp_path)})


@pytest.mark.parametrize("text", ["", "two words", "line\nbreak", "sk-ü", "x" * 5000])
def test_what_cannot_be_a_key_is_refused_without_being_shown(tmp_path, text):
    (tmp_path / "bench_key").write_text(text)
    with pytest.raises(CredentialMissing) as refused:
        find_credential("bench_key", {"CREDENTIALS_DIRECTORY": str(tmp_path)})
    assert not text or text not in str(refused.value)
    assert refused.value.__cause__ is None


def test_a_folder_in_place_of_a_key_is_told(tmp_path):
    (tmp_path / "bench_key").write_bytes(b"\xff\xfe")
    with pytest.raises(CredentialMissing, match="printable ASCII"):
        find_credential("bench_key", {"CREDENTIALS_DIRECTORY": str(tmp_path)})


def test_no_way_of_printing_a_secret_reveals_it():
    secret = Secret(KEY)
    printed = [
        repr(secret),
        str(secret),
        f"{secret}",
        f"{secret!r:>60}",
        str([secret]),
    ]
    assert not any(KEY in text for text in printed)
    assert secret.hidden_in(f"Incorrect API key provided: {KEY}.") == (
        "Incorrect API key provided: [key]."
    )


def test_a_secret_is_not_copied_into_a_file_or_another_process():
    with pytest.raises(TypeError):
        pickle.dumps(Secret(KEY))
    with pytest.raises(TypeError):
        copy.deepcopy(Secret(KEY))
