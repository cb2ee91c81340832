"""Try long and hard what must never happen: faults in every phase, kills, hogs, switches, soak."""
