"""Ready-made mechanisms: functions of lengths, masses and clearances that return a `Scene`.

In: lengths, masses, clearances and laws; out: a `Scene`. Uses `scene` and `base`.

Each is a plain function with keyword arguments, so it can be simulated, varied by a `Study`, or taken as the
start of a mechanism of one's own (``dataclasses.replace``). Arguments are SI units and radians. All clearance
joints of a mechanism share the sizes and laws given; `clearance` may also be a mapping with a number for
each joint.
"""

from .joints import hertz_stiffness
from .journals import free_journal, pendulum_in_bearing
from .linkages import four_bar, six_bar
from .sliders import flores_slider_crank, quick_return, slider_crank

__all__ = [
    "flores_slider_crank",
    "four_bar",
    "free_journal",
    "hertz_stiffness",
    "pendulum_in_bearing",
    "quick_return",
    "six_bar",
    "slider_crank",
]
