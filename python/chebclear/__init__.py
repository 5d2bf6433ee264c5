"""Dynamics of planar mechanisms with joint clearance and interval parameters.

A `Scene` says what the mechanism is, `simulate` gives its `Trajectory`, and a `Study` gives the `Band` of
every output when parameters are only known to lie in intervals. Units are SI with angles in radians.
"""

import lazy_loader

# The public names and where they come from stand in `__init__.pyi`, for type checkers too. Each is imported
# when it is used: all of them take half a second, and the command line answers Ctrl-C earlier than that.
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
