"""``python -m chebclear`` is the command ``chebclear``."""

from .cli import run_process

if __name__ == "__main__":
    raise SystemExit(run_process())
