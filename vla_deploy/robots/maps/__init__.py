"""Read and write the map of a robot's home."""
