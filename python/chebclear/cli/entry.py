"""The program from its first moment to its last, so that Ctrl-C is answered at all of them."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence

from .ending import EXIT_INTERRUPTED, EXIT_TERMINATED


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line of these words, or of the process, in this process; the exit code."""
    # Here, where an interrupt is answered.
    from .program import main as run

    return run(arguments)


def run_process() -> int:
    """Run the command line as all that this process does; the exit code."""
    # Pictures are only written to files: what a notebook or a terminal shows them with does not matter here.
    os.environ["MPLBACKEND"] = "agg"
    try:
        code = main()
        if code in (EXIT_INTERRUPTED, EXIT_TERMINATED):
            # All that must be closed is closed, and taking down large libraries would take as long again.
            sys.stderr.flush()
            os._exit(code)
        return code
    except KeyboardInterrupt:
        # Between the lines above, or after all is done.
        print("chebclear: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED
    finally:
        # What is done is done: the process only has to leave, which takes some hundredths of a second.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
