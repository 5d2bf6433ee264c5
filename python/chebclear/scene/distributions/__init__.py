"""How often the values of a parameter occur: one kind of distribution, or a family of them, a file.

In: numbers as a drawing or a measurement has them; out: `Distribution`. Uses `base`.
"""

from .bounded import Triangular, Uniform, triangular, uniform
from .distribution import Distribution, FileKey, inside
from .eccentric import Eccentric, eccentric
from .inspected import Inspected, inspected
from .lognormal import Lognormal, lognormal
from .normal import Capable, Normal, capable, normal
from .sampled import Sampled, sampled
from .skewed import Skewed, skewed

FILE_KEYS = {name: key for kind in Distribution.kinds.values() for name, key in kind.file_keys.items()}
"""What distributions take in scene files besides the interval."""

__all__ = [
    "FILE_KEYS",
    "Capable",
    "Distribution",
    "Eccentric",
    "FileKey",
    "Inspected",
    "Lognormal",
    "Normal",
    "Sampled",
    "Skewed",
    "Triangular",
    "Uniform",
    "capable",
    "eccentric",
    "inside",
    "inspected",
    "lognormal",
    "normal",
    "sampled",
    "skewed",
    "triangular",
    "uniform",
]
