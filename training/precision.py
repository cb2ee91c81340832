"""Say whether a processor multiplies in bfloat16; emulated, it is many times slower than fp32."""

import torch


def multiplies_in_bfloat16() -> bool:
    """Return whether oneDNN has kernels for it here: those of AVX2 alone have none."""
    return bool(torch.ops.mkldnn._is_mkldnn_bf16_supported())
