"""Reading mechanisms of other programs, whichever of them it is."""

from __future__ import annotations

import json
import os
from typing import Any

from ..base.arguments import Checks
from ..base.files import on_disk
from ..base.units import UnitError, convert
from ..errors import ArgumentTypeError, SceneError
from ..templates.template import Template
from .linkage import STEEL, Linkage
from .of_pmks import of_link
from .of_pylinkage import of_components, of_mechanism


def read_linkage(
    source: Any,
    *,
    length_unit: str | None = None,
    crank_speed: float | None = None,
    density: float = STEEL,
    cross_section: float | None = None,
) -> Template:
    """A mechanism of pylinkage or PMKS+ as a scene file.

    Parameters
    ----------
    source : pylinkage.Linkage, pylinkage.mechanism.Mechanism, path or str
        An object of pylinkage 1.3; a file that its `mechanism_to_json` wrote; a link of PMKS+
        (``"https://app.pmksplus.com/?..."``) or a file that it saved.
    length_unit : str, optional
        Unit of the lengths, such as ``"mm"``; needed for pylinkage, which has none.
    crank_speed : float, optional
        Angular velocity of the crank, positive counterclockwise [rad/s]; needed for pylinkage, which counts
        in steps. That of the source if not given.
    density : float
        Density of links without a mass [kg/m³]; that of steel if not given.
    cross_section : float, optional
        Cross section of the bars of links without a mass [m²]; needed if there are such. A link is made of
        bars from the middle of its pins to each of them, the block in a slot is a cube of this width.

    Returns
    -------
    Template
        With the parameters ``crank_speed`` and, of each link, ``NAME_length``, the distance of its first two
        pins. ``save`` writes the scene file. A pin is a point of each link that it joins, such as
        ``"AB.B"``, and a joint of the same name; a block that slides is ``NAME_block`` in ``NAME_guide``.

    Raises
    ------
    SceneError
        Where the source has parts that are not read, such as gears, cams and cylinders, two drives, or points
        that belong to no rigid link; all are named. If a file is of another program.
    ValueError
        If a number that is needed is missing or out of range.
    OSError
        If a file cannot be read.

    Examples
    --------
    >>> link = "https://app.pmksplus.com/?0.Fe.K,0.101.6A,A,0,0,0.0B,B,Fe,6G,0.0C,C,hm,Zy,0.4D,D,mS,38,0."
    >>> link += ".YRAB,,0,0,0,0,,A,B,,.YRBC,,0,0,0,0,,B,C,,.YRCD,,0,0,0,0,,C,D,,...N6"
    >>> template = read_linkage(link, cross_section=1e-4)
    >>> template.scene().check().degrees_of_freedom
    0
    """
    checks = Checks()
    density = checks.real("density", density, "kg/m³", above=0.0)
    if cross_section is not None:
        cross_section = checks.real("cross_section", cross_section, "m²", above=0.0)
    if crank_speed is not None:
        crank_speed = checks.real("crank_speed", crank_speed, "rad/s")
    scale = _scale(length_unit, checks)
    checks.finish()
    read = _linkage(source)
    read.finish()
    scale = read.length_unit if length_unit is None else scale
    speed = read.crank_speed if crank_speed is None else crank_speed
    if scale is None:
        checks.add("length_unit", "must be given, as the lengths of the source have no unit")
    if speed is None:
        checks.add("crank_speed", "must be given, as the source has no unit of time [rad/s]")
    checks.finish()
    assert scale is not None and speed is not None
    return read.template(scale, speed, density, cross_section)


def _scale(unit: str | None, checks: Checks) -> float | None:
    """A unit of length [m]."""
    try:
        return None if unit is None else convert(f"1 {unit}", "m")
    except UnitError as error:
        checks.add("length_unit", f"{error}")
        return None


def _linkage(source: Any) -> Linkage:
    if hasattr(source, "components"):
        return of_components(source)
    if hasattr(source, "joints") and hasattr(source, "links"):
        from pylinkage.mechanism import mechanism_to_dict

        return of_mechanism(mechanism_to_dict(source))
    if not isinstance(source, (str, os.PathLike)):
        raise ArgumentTypeError(f"source must be of pylinkage, a path or a link, got {source!r:.80}")
    text = os.fspath(source)
    if not text.startswith(("http://", "https://")):
        text = on_disk(text).read_text(encoding="utf-8")
    if not text.lstrip().startswith("{"):
        return of_link(text)
    try:
        return of_mechanism(json.loads(text))
    except (json.JSONDecodeError, RecursionError) as error:
        raise SceneError([("file", f"is not valid JSON: {error}")]) from None
