"""Say which part of the robot failed and why: conditions found, alarms raised, seen by whom."""
