"""The command ``chebclear``.

In: the words of a command line; out: tables on standard output, files, an exit code. Uses every room; its
`commands` are one file each.
"""

from .program import EXIT_BAD_INPUT as EXIT_BAD_INPUT
from .program import EXIT_UNREAD as EXIT_UNREAD
from .program import main as main
