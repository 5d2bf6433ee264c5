from .joints import hertz_stiffness as hertz_stiffness
from .journals import free_journal as free_journal, pendulum_in_bearing as pendulum_in_bearing
from .linkages import four_bar as four_bar, six_bar as six_bar
from .sliders import (
    flores_slider_crank as flores_slider_crank,
    quick_return as quick_return,
    slider_crank as slider_crank,
)

__all__: list[str]
