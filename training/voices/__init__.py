"""Make speech for training and measurements: synthetic voices, noise, rooms, mixtures at a ratio.

Nothing here is part of the robot. The engines are Debian packages; see requirements.txt.
"""
