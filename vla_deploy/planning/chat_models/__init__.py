"""Plan with chat models, on board or behind a server."""
