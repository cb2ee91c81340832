"""Let anyone who reaches this robot stop it: a small HTTP server of its own that can do no more."""
