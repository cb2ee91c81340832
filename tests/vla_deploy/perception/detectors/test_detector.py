"""Switch the model of a stepping node, through the topics of the supervisor."""

import dataclasses
from types import MappingProxyType

import numpy as np
import pytest

from drivers.clock import MonotonicClock
from platforms import Profile, load_profile
from vla_deploy.inference.errors import ManifestInvalid, ModelUnknown, RunFailed
from vla_deploy.inference.manifest import Tensor, Variant
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.inference.store import ModelStore, StoredModel
from vla_deploy.ipc import SharedSpace
from vla_deploy.perception.detectors.detector import Detector, open_detector
from vla_deploy.runtime.executors import low_priority_thread
from vla_deploy.runtime.reconfigurable_node import ReconfigurableNode

NO_HOST = type("NoHost", (), {"obstacles": lambda *_: (), "apply": lambda *_: ()})()


class Looker:
    """Look at the same image in every step, as perception would at the camera's."""

    period_s = 0.1

    def __init__(self, shelf: ModelShelf, profile: Profile, rgb: np.ndarray) -> None:
        self.shelf, self.rgb = shelf, rgb
        self.detector = open_detector(shelf, profile, 0)
        self.seen: list[tuple[str, int]] = []

    def start(self) -> None: ...

    def step(self) -> None:
        self.seen.append((self.detector.stats().model, len(self.detector.detect(self.rgb))))

    def stop(self) -> None:
        self.detector.close()

    def prepare(self, profile: Profile, model_tier: int) -> Detector:
        return open_detector(self.shelf, profile, model_tier)

    def commit(self, prepared: Detector) -> Detector:
        before, self.detector = self.detector, prepared
        return before

    def discard(self, prepared: Detector) -> None:
        prepared.close()


@pytest.fixture
def shelf(tmp_path, lay_out, blob_manifest, blobs):
    for name in ("medium", "small"):
        manifest = dataclasses.replace(blob_manifest, name=name)
        lay_out(tmp_path / "models", manifest, {Variant.INT8_U8S8: blobs.raw().SerializeToString()})
    return ModelShelf(
        store=ModelStore(tmp_path / "models", tmp_path / "none"),
        engines=tmp_path / "engines",
        clock=MonotonicClock(),
    )


@pytest.fixture
def profile():
    desktop = load_profile("desktop")
    choice = dataclasses.replace(desktop.models["detector"], tiers=("medium", "small"))
    return dataclasses.replace(desktop, models=MappingProxyType({"detector": choice}))


@pytest.fixture
def rgb():
    image = np.full((64, 96, 3), 90, dtype=np.uint8)
    image[16:32, 16:32] = (255, 0, 0)
    return image


class Answering:
    """Stand for a session whose graph left the shapes of its outputs open, and answers so."""

    def __init__(self, model: StoredModel, outputs: dict[str, np.ndarray]) -> None:
        self.model, self.outputs = model, outputs

    def run(self, _: object) -> dict[str, np.ndarray]:
        return self.outputs


@pytest.mark.parametrize(
    ("adapter", "shapes"),
    [
        ("yolo", [(1, 5, 96)]),
        ("yolo", [(1, 7)]),
        ("yolo_end_to_end", [(1, 2, 5)]),
        ("yolo_end_to_end", [(0, 2, 6)]),
        ("yolo_counted", [(1, 1), (1, 2, 5), (1, 2), (1, 2)]),
        ("yolo_counted", [(1, 1), (1, 2, 4), (1, 0), (1, 2)]),
        ("yolo_counted", [(1, 0), (1, 2, 4), (1, 2), (1, 2)]),
        ("centre_net", [(1, 2, 8, 12), (1, 4, 4, 6)]),
    ],
)
def test_outputs_of_another_shape_fail_the_frame_and_nothing_else(
    tmp_path, blob_manifest, rgb, adapter, shapes
):
    detection = dataclasses.replace(blob_manifest.detection, adapter=adapter)
    fitting = {
        "yolo": [(1, 7, "n")], "yolo_end_to_end": [(1, "n", 6)],
        "yolo_counted": [(1, 1), (1, "n", 4), (1, "n"), (1, "n")],
        "centre_net": [(1, 3, "h", "w"), (1, 4, "h", "w")],
    }[adapter]  # fmt: skip
    free = [tuple(f"d{axis}" for axis, _ in enumerate(shape)) for shape in fitting]
    if adapter == "centre_net":
        free = fitting
    outputs = tuple(
        Tensor(name=str(number), shape=shape, dtype="float32") for number, shape in enumerate(free)
    )
    manifest = dataclasses.replace(blob_manifest, detection=detection, outputs=outputs)
    answers = {str(number): np.ones(shape, np.float32) for number, shape in enumerate(shapes)}
    model = StoredModel(manifest=manifest, folder=tmp_path, is_embedded=False)
    with pytest.raises(RunFailed, match=r"^blobs: "):
        Detector(Answering(model, answers)).detect(rgb)


@pytest.mark.parametrize(("tier", "name"), [(0, "medium"), (1, "small"), (7, "small")])
def test_a_tier_names_the_model_and_the_last_one_is_the_smallest(shelf, profile, tier, name):
    detector = open_detector(shelf, profile, tier)
    assert (detector.stats().model, detector.stats().variant) == (name, Variant.INT8_U8S8)
    assert detector.detection.classes == ("red", "green", "blue")


def test_a_profile_without_a_detector_is_told(shelf, profile):
    bare = dataclasses.replace(profile, models={})
    with pytest.raises(ModelUnknown, match=r"profile desktop has no \[models.detector\], only: no"):
        open_detector(shelf, bare, 0)


def test_a_tier_that_names_no_model_is_told(shelf, profile):
    choice = dataclasses.replace(profile.models["detector"], tiers=("large",))
    with pytest.raises(ModelUnknown, match="no model 'large': expected one of medium, small"):
        open_detector(shelf, dataclasses.replace(profile, models={"detector": choice}), 0)


def test_a_model_of_another_role_is_told(shelf, profile, tmp_path):
    text = (tmp_path / "models" / "small" / "model.toml").read_text()
    spoken = text.replace('role = "detector"', 'role = "planner"')
    (tmp_path / "models" / "small" / "model.toml").write_text(spoken)
    with pytest.raises(ModelUnknown, match=r"models.detector.tiers: small is a planner"):
        open_detector(shelf, profile, 1)


def test_a_model_that_does_not_run_as_asked_is_told_to_the_log(shelf, profile, caplog):
    choice = dataclasses.replace(
        profile.models["detector"], providers=("CUDAExecutionProvider",), cpu_fallback=True
    )
    open_detector(shelf, dataclasses.replace(profile, models={"detector": choice}), 0).close()
    assert "degraded: CUDAExecutionProvider: this onnxruntime" in caplog.text


@pytest.fixture
def looker(shelf, profile, rgb):
    return Looker(shelf, profile, rgb)


@pytest.fixture
def node(tmp_path, looker, profile):
    """A stepping node that the supervisor has asked for a smaller model."""
    clock = MonotonicClock()
    executor = low_priority_thread(clock)
    node = ReconfigurableNode(
        "perception", looker, profile, ipc=tmp_path, clock=clock, host=NO_HOST, executor=executor
    )
    node.start()
    node.step()
    directives = SharedSpace(tmp_path, clock).cell_writer("resource_directives")
    directives.put_document({"rate_ratio": {}, "model_tier": {"perception": 1}})
    yield node
    node.stop()


def test_the_model_changes_between_two_steps_and_no_step_is_missed(node, looker, rgb):
    first, steps = looker.detector, 1
    while looker.seen[-1][0] == "medium":
        node.step()
        steps += 1
    assert {name for name, _ in looker.seen} == {"medium", "small"}
    assert len(looker.seen) == steps
    assert len({count for _, count in looker.seen}) == 1, "both see the same"
    with pytest.raises(RunFailed, match=r"medium.*: its session is closed"):
        first.detect(rgb)


def test_a_model_that_cannot_be_opened_leaves_the_present_one_at_work(
    tmp_path, node, looker, shelf, profile, caplog
):
    (tmp_path / "models" / "small" / "model.toml").write_text("role = 'detector'")
    while "degraded: no models of tier 1" not in caplog.text:
        node.step()
    assert "small/model.toml: " in caplog.text
    assert {name for name, _ in looker.seen} == {"medium"}
    with pytest.raises(ManifestInvalid):
        open_detector(shelf, profile, 1)
