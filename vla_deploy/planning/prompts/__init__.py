"""Put a command to a model: instructions from template files, and everything else as data."""
