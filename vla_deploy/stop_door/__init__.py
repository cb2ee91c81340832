"""Stop the robot by a small HTTP server of its own, which needs no login and can do no more."""
