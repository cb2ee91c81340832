"""Turn commands and model output into plans that may run."""
