"""Plan with models that run behind a server."""
