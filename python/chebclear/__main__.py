"""``python -m chebclear`` is the command ``chebclear``."""

from .cli import main

if __name__ == "__main__":
    raise SystemExit(main())
