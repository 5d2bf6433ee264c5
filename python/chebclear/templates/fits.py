"""ISO fits such as ``"25 H7/f6"``: the clearance of a journal in its bearing, and its interval."""

from __future__ import annotations

from fractions import Fraction

from ..base.quantities import Interval

EXAMPLE = '"25 H7/f6"'


class FitError(ValueError):
    """A fit that is unknown, or leaves no clearance."""


def radial_clearance(fit: str) -> Interval:
    """Radial clearance of a fit [m]: half the difference of the diameters, at the limits of both.

    A text such as ``"25 H7/f6"`` has the nominal diameter in millimeters, hole and shaft; ISO 286, hole
    basis, grades 5 to 11, up to 500 mm. Otherwise a FitError, also if a journal may be as large as its
    bearing.
    """
    if not fit.isascii():
        raise FitError(f"is no fit as {EXAMPLE}: it is written in ASCII letters and digits")
    try:
        import pressfit
    except ImportError:
        raise FitError(
            "needs the tables of the package pressfit: install chebclear[fits], or give limits instead"
        ) from None
    try:
        least, most = pressfit.fit(fit).clearance_um
    except (ValueError, NotImplementedError) as error:
        raise FitError(f"is no fit as {EXAMPLE}: {error}") from None
    if least <= 0:
        words = f"{least:g} to {most:g} um" if most > 0 else f"at most {most:g} um"
        raise FitError(
            f"leaves {words} between the diameters: without play at every limit this is no clearance joint; "
            f"take a looser shaft, such as that of {EXAMPLE}"
        )
    # Exact until the one rounding, as quantities are.
    lower, upper = (float(Fraction(diametral) / 2_000_000) for diametral in (least, most))
    return Interval(lower, upper)


def grade_tolerance(size: float, grade: int) -> float:
    """Half of the standard tolerance of a grade of ISO 286 [m], for a size [m].

    A FitError if it is none of the grades 5 to 11, or the size not from 1 mm to 500 mm: small play between
    parts is no size of a part.
    """
    try:
        from pressfit.tables import GRADES, it_value
    except ImportError:
        raise FitError("grades need the tables of the package pressfit: install chebclear[fits]") from None
    if grade not in GRADES:
        raise FitError(f"has no grade IT{grade}: those from IT{GRADES[0]} to IT{GRADES[-1]} are known")
    if not 1e-3 <= size <= 0.5:
        raise FitError(f"grades are those of sizes from 1 mm to 500 mm, got {1e3 * size:g} mm")
    return float(Fraction(it_value(round(1e3 * size, 6), grade)) / 2_000_000)
