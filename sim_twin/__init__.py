"""Emulate the robot's devices in a simulated world, down to the bytes on the wire."""

import os

# MuJoCo looks for OpenGL when it is imported, and fails there on a bad value or a missing library.
# The twin opens EGL itself, in sim_twin/pictures/renderer.py, where it can say what to install.
os.environ["MUJOCO_GL"] = "off"
