"""Name the exit codes of every process, so that the supervisor understands how one ended."""

EXIT_OK = 0
EXIT_CRASHED = 1
EXIT_CONFIGURATION = 2
EXIT_DEVICE_ABSENT = 4
"""A device is not there, or silent: it may come by itself. 3 is taken by commands that ask."""
