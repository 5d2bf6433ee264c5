"""The clearance of ISO fits, held to printed tables of limits.

Holes: D-M-E, Mold Bases & Plates (2020), Technical Reference, Table 6, "Tolerances for inside dimensions
(holes)". Shafts: Nabeya Bi-tech Kaisha, "Deviations of Shafts to be Used in Commonly Used Fits" (2015), which
agrees with Sumitomo Electric, "Dimensional Tolerances for Regularly Used Shaft Fits", JIS B 0401 (1999);
f6 and g6 above 120 mm: SKF, "Shaft tolerances and resultant fits". Widths of the grades above 80 mm: BIG
Daishowa, "Shaft tolerances", classes h6 to h9. All repeat ISO 286-2; limits in micrometers.
"""

import pytest
from chebclear.templates.fits import radial_clearance

RANGES = ((3, 6), (6, 10), (10, 14), (18, 24), (30, 40), (50, 65), (80, 100), (120, 140), (180, 200))
# Upper limits of holes H; their lower limits are 0.
HOLES = {
    "H6": (8, 9, 11, 13, 16, 19, 22, 25, 29),
    "H7": (12, 15, 18, 21, 25, 30, 35, 40, 46),
    "H8": (18, 22, 27, 33, 39, 46, 54, 63, 72),
    "H9": (30, 36, 43, 52, 62, 74, 87, 100, 115),
    "H11": (75, 90, 110, 130, 160, 190, 220, 250, 290),
}
# Upper and lower limits of shafts, as far as their table goes.
SHAFTS = {
    "c9": ((-70, -100), (-80, -116), (-95, -138), (-110, -162), (-120, -182), (-140, -214), (-170, -257)),
    "d8": ((-30, -48), (-40, -62), (-50, -77), (-65, -98), (-80, -119), (-100, -146), (-120, -174)),
    "d9": ((-30, -60), (-40, -76), (-50, -93), (-65, -117), (-80, -142), (-100, -174), (-120, -207)),
    "e7": ((-20, -32), (-25, -40), (-32, -50), (-40, -61), (-50, -75), (-60, -90), (-72, -107)),
    "e8": ((-20, -38), (-25, -47), (-32, -59), (-40, -73), (-50, -89), (-60, -106), (-72, -126)),
    "e9": ((-20, -50), (-25, -61), (-32, -75), (-40, -92), (-50, -112), (-60, -134), (-72, -159)),
    "f6": (
        *((-10, -18), (-13, -22), (-16, -27), (-20, -33), (-25, -41), (-30, -49), (-36, -58)),
        *((-43, -68), (-50, -79)),
    ),
    "f7": ((-10, -22), (-13, -28), (-16, -34), (-20, -41), (-25, -50), (-30, -60), (-36, -71)),
    "f8": ((-10, -28), (-13, -35), (-16, -43), (-20, -53), (-25, -64), (-30, -76), (-36, -90)),
    "g5": ((-4, -9), (-5, -11), (-6, -14), (-7, -16), (-9, -20), (-10, -23), (-12, -27)),
    "g6": (
        *((-4, -12), (-5, -14), (-6, -17), (-7, -20), (-9, -25), (-10, -29), (-12, -34)),
        *((-14, -39), (-15, -44)),
    ),
}


@pytest.mark.parametrize("shaft", SHAFTS)
@pytest.mark.parametrize("hole", HOLES)
def test_fits_have_the_clearance_of_printed_tables(hole, shaft):
    pytest.importorskip("pressfit", reason="the extra chebclear[fits] is not installed")
    for (_, size), widest, (upper, lower) in zip(RANGES, HOLES[hole], SHAFTS[shaft], strict=False):
        found = radial_clearance(f"{size} {hole}/{shaft}")
        # Exact: half of a whole number of micrometers.
        assert (found.lower, found.upper) == (float(f"{-upper / 2}e-6"), float(f"{(widest - lower) / 2}e-6"))
