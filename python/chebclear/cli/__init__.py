"""The command ``chebclear``.

In: the words of a command line; out: tables on standard output, files, an exit code. Uses every room; its
`commands` are one file each.
"""

from .entry import main as main, run_process as run_process
