"""Let what was recognised by its size vote for its class, as a detector's boxes do."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from vla_deploy.perception.detectors.boxes import Boxes
from vla_deploy.perception.geometry.plane_depth import KnownSight
from vla_deploy.perception.images.network_view import NetworkView
from vla_deploy.perception.naming.class_weighting import ClassReliability

KNOWN_PRECISION: Final = 0.97
"""How sure a size is: surer than what the form of a thing drawn by that size says by itself."""


def with_known(network: NetworkView | None, sights: Sequence[KnownSight]) -> NetworkView | None:
    """Return what the detector found together with what was recognised by size."""
    if not sights:
        return network
    known = NetworkView(
        boxes=Boxes(
            corners_px=np.array([one.box_px for one in sights], dtype=np.float32),
            scores=np.ones(len(sights), dtype=np.float32),
            classes=np.arange(len(sights)),
        ),
        reliabilities=tuple(
            ClassReliability(class_name=one.class_name, precision=KNOWN_PRECISION) for one in sights
        ),
    )
    return known if network is None else network.joined(known)
