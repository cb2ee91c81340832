"""Show the robot to viewers: what its topics mean, in schemas that Foxglove and others know."""
