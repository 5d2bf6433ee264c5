"""The pictures that users draw, gathered: imported when the first of them is asked for."""

from .animation.animate import Animation, animate
from .bands import plot_band, plot_sensitivity
from .bifurcations import plot_bifurcation
from .costs import plot_study_tradeoff, plot_tradeoff
from .drawing.scene import plot_scene
from .features import plot_ranking, plot_shares, plot_tornado
from .polynomials import plot_coefficients, plot_prediction
from .runs import plot_contacts, plot_orbit, plot_poincare, plot_trajectory
from .spectra import plot_spectrogram
from .style import print_style

__all__ = [
    "Animation",
    "animate",
    "plot_band",
    "plot_bifurcation",
    "plot_coefficients",
    "plot_contacts",
    "plot_orbit",
    "plot_poincare",
    "plot_prediction",
    "plot_ranking",
    "plot_scene",
    "plot_sensitivity",
    "plot_shares",
    "plot_spectrogram",
    "plot_study_tradeoff",
    "plot_tornado",
    "plot_tradeoff",
    "plot_trajectory",
    "print_style",
]
