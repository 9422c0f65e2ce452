"""Rod on a film by the film's law: closed form, table of rods, or finite elements."""

import math
from functools import lru_cache

from memscal.mechanics.contact import Contact
from memscal.mechanics.tabulated_rod import largest_tabulated_load, tabulated_rod
from memscal.model.film import LINEAR, NEO_HOOKEAN, ElasticFilm
from memscal.model.indenter import Rod, RoundIndenter


@lru_cache(maxsize=256)
def press_rod(
    film: ElasticFilm, rod: RoundIndenter, load: float, friction: float | None = None
) -> Contact:
    """Press a rod to a load (N) by the film's law, linear where it states none."""
    # Friction is 0 or inf; by default a linear film slides, which changes its base stress by 1e-3,
    # and one of another law sticks, which is solved at any depth.  A sphere sinks less: its film
    # is linear.
    strain = None
    if film.law in ("", LINEAR) or not isinstance(rod, Rod):
        friction = friction or 0.0
        strain = "linear"
    else:
        friction = math.inf if friction is None else friction
        if film.law == NEO_HOOKEAN:
            tabulated = tabulated_rod(film, rod, load, sticking=friction > 0)
            if tabulated is not None:
                return tabulated
    # Imported here, for a rod that is in the table needs no solver.
    from memscal.mechanics.indent import indent

    return indent(film, rod, load=load, friction=friction, strain=strain)


@lru_cache(maxsize=256)
def is_tabulated(
    film: ElasticFilm, rod: RoundIndenter, load: float, friction: float | None = None
) -> bool:
    """Whether a neo-Hookean film is found in the table, in milliseconds; else it is solved."""
    sticking = friction is None or friction > 0
    return isinstance(rod, Rod) and load <= largest_tabulated_load(film, rod, sticking=sticking)
