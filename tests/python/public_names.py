"""What users may name: the package and its public modules."""

from typing import Any

import chebclear as cc

ROOMS = ("distributions", "errors", "features", "laws", "mechanisms", "motions", "plots", "results")


def public_names() -> dict[str, Any]:
    """Every public object by its name, without that of its module."""
    found = {name: getattr(cc, name) for name in cc.__all__ if name not in ROOMS}
    for room in ROOMS:
        module = getattr(cc, room)
        found |= {name: getattr(module, name) for name in module.__all__}
    return found
