"""Hold the contract of plans: what a plan is, what it may name, what its skills need and leave.

What makes plans and what carries them out both import it, and nothing of each other. ROS's Python
runs `catalogue`, `errors` and `knowledge`: they import nothing that it lacks.
"""
