import copy
import pickle  # noqa: TID251 - to show that a secret does not go this way

import pytest

from vla_deploy.model_servers.credentials import find_credential, key_folders
from vla_deploy.model_servers.errors import CredentialMissing
from vla_deploy.runtime.secret import Secret

KEY = "sk-very-secret-0123456789"


def put(folder, name, text, mode=0o600):
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(text)
    (folder / name).chmod(mode)


def test_systemd_s_credential_comes_before_the_own_file_and_the_environment_is_not_asked(tmp_path):
    base, systemds = tmp_path / "base", tmp_path / "systemd"
    environment = {"CREDENTIALS_DIRECTORY": str(systemds), "BENCH_KEY": "another"}
    folders = key_folders(base, environment)
    with pytest.raises(CredentialMissing, match=r"mode 600: .*--credential bench_key=FILE"):
        find_credential("bench_key", folders)
    own = tmp_path / "base-config" / "credentials"
    own.parent.mkdir()
    put(own, "bench_key", KEY + "\n")
    assert find_credential("bench_key", folders).reveal() == KEY
    put(systemds, "bench_key", "theirs", mode=0o440)
    assert find_credential("bench_key", folders).reveal() == "theirs"


def test_a_key_that_others_may_read_is_refused(tmp_path):
    put(tmp_path, "bench_key", KEY, mode=0o644)
    with pytest.raises(CredentialMissing, match="others may read the key"):
        find_credential("bench_key", (tmp_path,))


@pytest.mark.parametrize("text", ["", "two words", "line\nbreak", "sk-ü", "x" * 5000])
def test_what_cannot_be_a_key_is_refused_without_being_shown(tmp_path, text):
    put(tmp_path, "bench_key", text)
    with pytest.raises(CredentialMissing) as refused:
        find_credential("bench_key", (tmp_path,))
    assert not text or text not in str(refused.value)
    assert refused.value.__cause__ is None


def test_a_folder_in_place_of_a_key_is_told(tmp_path):
    put(tmp_path, "bench_key", "")
    (tmp_path / "bench_key").write_bytes(b"\xff\xfe")
    with pytest.raises(CredentialMissing, match="printable ASCII"):
        find_credential("bench_key", (tmp_path,))


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
