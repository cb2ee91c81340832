"""Move a robot by hand: by a leader arm that it follows, by keys, by a gamepad."""
