"""Keep the last half minute of everything, write it down when the robot stops, judge it again."""
