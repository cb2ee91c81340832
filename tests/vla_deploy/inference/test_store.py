import dataclasses

import pytest

from vla_deploy.inference.errors import ModelFileSpoiled, ModelUnknown
from vla_deploy.inference.manifest import ModelFile, Variant
from vla_deploy.inference.store import ModelStore, StoredModel, sha256_of


@pytest.fixture
def store(tmp_path, lay_out, blob_manifest):
    """One model comes with the software, another was added."""
    for root, name in (("embedded", "ours"), ("user", "mine")):
        manifest = dataclasses.replace(blob_manifest, name=name)
        lay_out(tmp_path / root, manifest, {Variant.FP32: b"graph"})
    return ModelStore(tmp_path / "user", tmp_path / "embedded")


def test_models_of_both_places_are_found(store):
    assert store.names() == ("mine", "ours")
    assert [store.load(name).is_embedded for name in store.names()] == [False, True]
    assert store.load("mine").folder == store.user / "mine"


@pytest.mark.parametrize("name", ["yours", "", "..", "../user/mine", "."])
def test_an_unknown_name_is_told_with_those_that_are_known(store, name):
    with pytest.raises(ModelUnknown, match="expected one of mine, ours"):
        store.load(name)


def test_a_place_that_does_not_exist_holds_nothing(tmp_path):
    assert ModelStore(tmp_path / "none", tmp_path / "nowhere").names() == ()


def test_a_draft_is_no_model_before_it_is_installed(store):
    draft = store.draft("fresh")
    (draft / "model.toml").write_text("")
    assert store.names() == ("mine", "ours")
    assert store.install(draft) == store.user / "fresh"
    assert store.names() == ("fresh", "mine", "ours")
    assert sorted(path.name for path in store.user.iterdir()) == ["fresh", "mine"]


def test_installing_replaces_what_was_there_and_abandoning_leaves_it(store):
    before = (store.user / "mine" / "model.toml").read_text()
    draft = store.draft("mine")
    (draft / "model.toml").write_text("new")
    store.abandon(draft)
    assert (store.user / "mine" / "model.toml").read_text() == before
    draft = store.draft("mine")
    (draft / "model.toml").write_text("new")
    store.install(draft)
    assert (store.user / "mine" / "model.toml").read_text() == "new"
    assert [path.name for path in store.user.iterdir()] == ["mine"]


@pytest.mark.parametrize(
    ("name", "why"), [("ours", "comes with the software"), ("My Model", "expected small letters")]
)
def test_a_name_that_cannot_be_given_is_refused(store, name, why):
    with pytest.raises(ModelUnknown, match=why):
        store.draft(name)


def test_only_what_was_added_is_removed(store):
    store.remove("mine")
    assert store.names() == ("ours",)
    with pytest.raises(ModelUnknown, match="no model 'ours' was added"):
        store.remove("ours")


def test_a_half_written_part_is_found(tmp_path, blob_manifest):
    part = tmp_path / "model.bin"
    part.write_text("model")
    parts = (ModelFile(path=part.name, sha256=sha256_of(part)),)
    manifest = dataclasses.replace(blob_manifest, parts=parts)
    model = StoredModel(manifest=manifest, folder=tmp_path)
    model.check_parts()
    part.write_text("mod")
    with pytest.raises(ModelFileSpoiled, match=r"model\.bin.*add the model again"):
        model.check_parts()
    part.unlink()
    with pytest.raises(ModelFileSpoiled, match=r"model\.bin: No such file"):
        model.check_parts()
