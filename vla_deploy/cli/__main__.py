"""Start the command line; Ctrl-C ends it without a traceback from its first moment on."""

import signal
import sys


def main() -> int:
    """Load the commands, which takes a second, then run one."""
    interrupt = signal.getsignal(signal.SIGINT)
    if interrupt is signal.default_int_handler:  # a shell's background job ignores Ctrl-C
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from vla_deploy.cli.main import main as run_command

    signal.signal(signal.SIGINT, interrupt)
    return run_command()


if __name__ == "__main__":
    sys.exit(main())
