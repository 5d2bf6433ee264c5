"""What is asked of the samples of a run, by name of the output."""

from __future__ import annotations

from ...base.arguments import Checks
from ...base.named import Named
from ...base.rows import Array
from ...scene.columns import column_unit
from ...scene.motions import Speed
from ...scene.scene import Scene
from .cycles import Cycles, cycles_of
from .spectrum import Spectrum, spectrum_of


class WithSignals(Named[Array]):
    """Base of runs, which have columns over equally spaced instants ``t``."""

    t: Array
    scene: Scene

    def spectrum(self, output: str, *, angle: str | None = None, window: float | None = None) -> Spectrum:
        """Averaged spectrum of an output, over the frequency or over the orders of a crank (Welch's method).

        The samples are cut into pieces that overlap by half; each loses its mean and is weighted by a Hann
        window. Leave out the starting transient with ``skip=``.

        Parameters
        ----------
        output : str
            Name of a column.
        angle : str, optional
            Body or joint whose revolutions are the abscissa: the output is interpolated at equal steps of its
            angle, by cubics, so that a speed that varies does not smear the orders. The run must have the
            column ``"NAME.angle"``.
        window : float, optional
            Length of a piece [s], or in whole revolutions with an angle [-]; an eighth of the run if not
            given, and at least four revolutions of its drive. Lines are the inverse of it apart.

        Raises
        ------
        KeyError
            If a column is unknown.
        ValueError, TypeError
            If the window does not fit, it does not turn throughout, or the run ended early.

        >>> import chebclear as cc
        >>> scene = cc.mechanisms.slider_crank(clearance_at=())
        >>> run = cc.simulate(scene, duration=8 * scene.period, samples=2881)
        >>> run.spectrum("slider.ax", angle="crank")
        <Spectrum of slider.ax over the orders of crank: 721 lines, 3 pieces>
        """
        checks = Checks()
        if angle is not None and not isinstance(angle, str):
            checks.add(
                "angle", f"must be the name of a body or joint that turns, got {angle!r}", wrong_type=True
            )
        if window is not None:
            window = checks.real("window", window, "s" if angle is None else "-", above=0.0)
        values = self._column(checks, output)
        turned = None if angle is None else self._entry(f"{angle}.angle")
        turns = any(isinstance(drive, Speed) and drive.speed for drive in self.scene.drives)
        period = self.scene.period if turns else 0.0
        return spectrum_of(self.t, values, output, column_unit(output), angle, turned, window, period)

    def cycles(self, output: str) -> Cycles:
        """Load cycles of an output by rainflow counting (ASTM E1049), for fatigue.

        Needs the package rainflow: ``pip install 'chebclear[cycles]'``. Half cycles that a single revolution
        leaves open close over several: count over some, after the starting transient (``skip=``).

        Parameters
        ----------
        output : str
            Name of a column.

        Returns
        -------
        Cycles
            Ranges, means and counts.

        Raises
        ------
        ImportError
            If the package is not installed.
        KeyError
            If the column is unknown.
        ValueError, TypeError
            If the run ended early, or `output` is no name of one column.

        >>> import chebclear as cc
        >>> scene = cc.mechanisms.slider_crank(clearance_at=())
        >>> run = cc.simulate(scene, duration=4 * scene.period, samples=1441)
        >>> print(run.cycles("slider.ax"))  # doctest: +SKIP
        4 cycles, largest range 3.15 km/s²
        """
        return cycles_of(self._column(Checks(), output), output, column_unit(output))

    def _column(self, checks: Checks, output: str) -> Array:
        """The samples of one output; raises what is wrong."""
        if not isinstance(output, str):
            checks.add("output", f"must be the name of a column, got {output!r}", wrong_type=True)
        checks.finish()
        return self._entry(output)
