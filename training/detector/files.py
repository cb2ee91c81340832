"""Name the files of the finished model."""

FILES = {
    "fp32": "detector.onnx",
    "int8_u8s8": "detector_int8_u8s8.onnx",
    "int8_s8s8": "detector_int8_s8s8.onnx",
}
"""Types of activations, then weights. TensorRT takes only signed and symmetric ones, CPUs are fast
with unsigned activations."""
METRICS = "metrics.json"
CARD = "card.md"
MANIFEST = "model.toml"
