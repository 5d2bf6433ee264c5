"""ISO fits such as ``"25 H7/f6"``: the clearance of a journal in its bearing, and its interval."""

from __future__ import annotations

from fractions import Fraction

from ..base.quantities import Interval

EXAMPLE = '"25 H7/f6"'


class FitError(ValueError):
    """A fit that is unknown, or leaves no clearance."""


def radial_clearance(fit: str) -> Interval:
    """Radial clearance of a fit [m]: half the difference of the diameters, at the limits of both.

    Parameters
    ----------
    fit : str
        Nominal diameter in millimeters, hole and shaft, such as ``"25 H7/f6"``; ISO 286, hole basis, grades 5
        to 11, up to 500 mm.

    Returns
    -------
    Interval

    Raises
    ------
    FitError
        If the fit is unknown, or a journal may be as large as its bearing, or the optional package with the
        tables is not installed.
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
