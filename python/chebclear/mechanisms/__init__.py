"""Ready-made mechanisms: functions of lengths, masses and clearances that return a `Scene`.

In: lengths, masses, clearances and laws; out: a `Scene`. Uses `scene` and `base`.

Each is a plain function with keyword arguments, so it can be simulated, varied by a `Study`, or taken as the
start of a mechanism of one's own (``dataclasses.replace``). Arguments are SI units and radians. All clearance
joints of a mechanism share the sizes and laws given; `clearance` may also be a mapping with a number for
each joint.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
