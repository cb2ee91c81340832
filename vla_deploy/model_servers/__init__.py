"""Ask language and vision models that run behind a server, on this robot or elsewhere."""
