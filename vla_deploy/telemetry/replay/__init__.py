"""Show what was recorded as if it were happening: the topics of a run, and nobody to command."""
