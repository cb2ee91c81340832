"""Find things in an image by a model of the role `detector`."""

from typing import Final

import numpy as np

from platforms import Profile
from vla_deploy.inference.errors import ModelMismatch, RunFailed
from vla_deploy.inference.graph_check import output_faults
from vla_deploy.inference.manifest import DetectionOutputs
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.inference.session import ModelSession, SessionStats
from vla_deploy.perception.detectors.adapters import ADAPTERS, Outputs
from vla_deploy.perception.detectors.boxes import Boxes
from vla_deploy.perception.detectors.image_input import Image, fit_image

ROLE: Final = "detector"


class Detector:
    """Hold one open model and read its outputs."""

    def __init__(self, session: ModelSession) -> None:
        """Own a session; `close` closes it.

        Raises:
            ModelMismatch: the adapter is unknown, or the outputs are not what it reads.
        """
        self._session = session
        self._detection = detection_of(session)
        self._adapter = ADAPTERS[self._detection.adapter]
        self._input = session.model.manifest.inputs[0]
        self._outputs = [tensor.name for tensor in session.model.manifest.outputs]

    @property
    def detection(self) -> DetectionOutputs:
        """Return how its outputs are read, and how good it was measured to be."""
        return self._detection

    def detect(self, rgb: Image) -> Boxes:
        """Return the boxes in an RGB image (h, w, 3), in its pixels, the surest first.

        Raises:
            RunFailed: the model failed, or its outputs cannot be.
        """
        tensor, placement = fit_image(rgb, self._detection.image, self._input.dtype)
        outputs = self._session.run({self._input.name: tensor})
        ordered = tuple(outputs[name] for name in self._outputs)
        faults = tuple(output_faults(outputs, self._session.model.manifest))
        if faults:
            raise RunFailed(f"{self._session.model.manifest.name}: {'; '.join(faults)}")
        boxes = self._read(ordered)
        self._check(boxes)
        return placement.to_image(boxes)

    def stats(self) -> SessionStats:
        """Return what the model has cost so far."""
        return self._session.stats()

    def close(self) -> None:
        """Release the memory."""
        self._session.close()

    def _read(self, outputs: Outputs) -> Boxes:
        """Read outputs whose shapes the graph may have left open until now."""
        try:
            return self._adapter.read(outputs, self._detection)
        except (RunFailed, IndexError, ValueError) as error:
            name, adapter = self._session.model.manifest.name, self._detection.adapter
            shapes = " and ".join(str(list(output.shape)) for output in outputs)
            raise RunFailed(
                f"{name}: outputs {shapes}, which adapter {adapter} cannot read: {error}"
            ) from error

    def _check(self, boxes: Boxes) -> None:
        """Refuse classes and scores that cannot be."""
        name, count = self._session.model.manifest.name, len(self._detection.classes)
        if not len(boxes):
            return
        if boxes.classes.min() < 0 or boxes.classes.max() >= count:
            odd = [int(one) for one in np.unique(boxes.classes) if not 0 <= one < count]
            raise RunFailed(
                f"{name}: told class {odd}, its manifest lists {count}: 0 to {count - 1}"
            )
        if boxes.scores[0] > 1.0:
            raise RunFailed(
                f"{name}: told a score of {boxes.scores[0]:.3g}, expected 0 to 1; "
                "is the sigmoid missing in the export?"
            )


def detection_of(session: ModelSession) -> DetectionOutputs:
    """Return how a session's outputs are read.

    Raises:
        ModelMismatch: it is no detector, the adapter is unknown, or reads other outputs.
    """
    manifest = session.model.manifest
    detection = manifest.detection
    if detection is None:
        raise ModelMismatch(manifest.name, (f"expected a detector, its role is {manifest.role}",))
    if detection.adapter not in ADAPTERS:
        known = ", ".join(ADAPTERS)
        fault = f"detection.adapter: got {detection.adapter!r}, expected one of {known}"
        raise ModelMismatch(manifest.name, (fault,))
    faults = tuple(ADAPTERS[detection.adapter].faults(manifest.outputs, detection))
    if faults:
        raise ModelMismatch(f"{manifest.name}, adapter {detection.adapter}", faults)
    return detection


def open_detector(shelf: ModelShelf, profile: Profile, model_tier: int) -> Detector:
    """Open the detector that a profile chooses, warm; for a node's `prepare`.

    Raises:
        InferenceError: it cannot be used as the profile asks; each kind says what to do.
    """
    session = shelf.open(ROLE, profile, model_tier)
    try:
        return Detector(session)
    except ModelMismatch:
        session.close()
        raise
