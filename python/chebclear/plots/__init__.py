"""Figures of one thing each; every function takes `ax=None` and returns the Axes.

In: results; out: matplotlib Axes. Uses `scene`, `report` and `base`; they name results for types
only.
"""

import lazy_loader

# As in the package: Matplotlib is imported when the first picture is asked for.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
