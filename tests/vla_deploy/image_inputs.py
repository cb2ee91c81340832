"""Describe the image that most detectors take: RGB by letterbox, in planes, scaled to 0..1."""

from vla_deploy.inference.manifest import Fit, ImageInput, TensorLayout


def letterboxed(width_px: int, height_px: int) -> ImageInput:
    """Return the input of a network of this size."""
    return ImageInput(
        width_px=width_px,
        height_px=height_px,
        layout=TensorLayout.NCHW,
        colour="rgb",
        fit=Fit.LETTERBOX,
        fill=114,
        scale=1 / 255,
        mean=(0.0, 0.0, 0.0),
        std=(1.0, 1.0, 1.0),
    )
