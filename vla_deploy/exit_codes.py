"""Name the exit codes of every process, so that the supervisor understands how one ended."""

EXIT_OK = 0
EXIT_CRASHED = 1
EXIT_CONFIGURATION = 2
