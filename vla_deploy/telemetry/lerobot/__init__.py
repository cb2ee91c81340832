"""Write recordings as LeRobot datasets, version 3.0, and read such datasets.

Format: huggingface/lerobot v0.6.1, datasets/. Needs the extra `lerobot`; torch is not needed.
"""
