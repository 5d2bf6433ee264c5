from .animation.animate import Animation as Animation, animate as animate
from .bands import (
    plot_agreement as plot_agreement,
    plot_band as plot_band,
    plot_coefficients as plot_coefficients,
    plot_lost_motion as plot_lost_motion,
    plot_prediction as plot_prediction,
    plot_sensitivity as plot_sensitivity,
)
from .bifurcations import plot_bifurcation as plot_bifurcation, plot_sweep as plot_sweep
from .costs import (
    plot_allocation as plot_allocation,
    plot_study_tradeoff as plot_study_tradeoff,
    plot_tradeoff as plot_tradeoff,
)
from .drawing.scene import plot_scene as plot_scene
from .features import (
    plot_difference as plot_difference,
    plot_identification as plot_identification,
    plot_ranking as plot_ranking,
    plot_share as plot_share,
    plot_shares as plot_shares,
    plot_tornado as plot_tornado,
)
from .runs import (
    plot_contacts as plot_contacts,
    plot_orbit as plot_orbit,
    plot_poincare as plot_poincare,
    plot_trajectory as plot_trajectory,
    plot_wear as plot_wear,
)
from .spectra import (
    plot_cycles as plot_cycles,
    plot_spectrogram as plot_spectrogram,
    plot_spectrum as plot_spectrum,
)
from .style import print_style as print_style
