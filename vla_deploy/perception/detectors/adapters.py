"""List the ways in which detectors tell what they found; a manifest names one of them."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from vla_deploy.inference.manifest import DetectionOutputs, Tensor
from vla_deploy.perception.detectors import centre_net, yolo
from vla_deploy.perception.detectors.boxes import Boxes

Outputs = yolo.Outputs


@dataclass(frozen=True, slots=True, kw_only=True)
class Adapter:
    """Read one kind of outputs.

    `faults` finds from their declared shapes why they are of another kind. `read` returns boxes in
    pixels of the input, from outputs in the order in which the manifest lists them.
    """

    summary: str
    faults: Callable[[tuple[Tensor, ...], DetectionOutputs], Iterator[str]]
    read: Callable[[Outputs, DetectionOutputs], Boxes]


ADAPTERS: Final[Mapping[str, Adapter]] = {
    "yolo": Adapter(
        summary="YOLO v8, v9, v11, v12 as exported: [1, 4 + classes, boxes], doubles removed here",
        faults=yolo.raw_faults,
        read=yolo.read_raw,
    ),
    "yolo_end_to_end": Adapter(
        summary="YOLO v10, or any with NMS in the graph: [1, boxes, 6], corners, score, class",
        faults=yolo.end_to_end_faults,
        read=yolo.read_end_to_end,
    ),
    "yolo_counted": Adapter(
        summary="NMS in the graph, four outputs: count, boxes [1, n, 4], scores, classes",
        faults=yolo.counted_faults,
        read=yolo.read_counted,
    ),
    "centre_net": Adapter(
        summary="the embedded detector: heat [1, classes, h, w] and edges [1, 4, h, w] in pixels",
        faults=centre_net.faults,
        read=centre_net.read,
    ),
}
