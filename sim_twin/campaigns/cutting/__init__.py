"""Cut the power while releases are added, switched and removed."""
