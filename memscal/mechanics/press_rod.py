"""Rod on a film by the film's law: closed form, table of rods, or finite elements."""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from memscal.errors import ConvergenceError, DomainError
from memscal.mechanics.contact import Contact
from memscal.mechanics.tabulated_rod import (
    TabulatedField,
    base_wavenumbers,
    largest_tabulated_load,
    tabulated_rod,
)
from memscal.model.film import LINEAR, NEO_HOOKEAN, ElasticFilm
from memscal.model.indenter import Rod, RoundIndenter

#: What a rod that cannot be solved raises.
UNSOLVED = (ConvergenceError, DomainError)


@lru_cache(maxsize=256)
def press_rod(
    film: ElasticFilm, rod: RoundIndenter, load: float, friction: float | None = None
) -> Contact:
    """Press a rod to a load (N); where law or friction are not stated, by the best estimate.

    A film without a law is taken as neo-Hookean, as elastomers are, or as linear where that cannot
    be solved.  Friction is 0 or inf; where it is not stated, a film at finite strain has the base
    stress midway between sticking and sliding.
    """
    # Imported here, for a rod that is in the table needs no solver.
    from memscal.mechanics.indent import indent

    # A linear film slides, which changes its base stress by 1e-3.  A sphere sinks less: its film
    # is linear.
    if film.law == LINEAR or not isinstance(rod, Rod):
        return indent(film, rod, load=load, friction=friction or 0.0, strain="linear")
    if not film.law:
        try:
            return press_rod(replace(film, law=NEO_HOOKEAN), rod, load, friction)
        except UNSOLVED:
            return press_rod(replace(film, law=LINEAR), rod, load, friction)
    if friction is None:
        return _midway(film, rod, load)
    tabulated = None
    if film.law == NEO_HOOKEAN:
        tabulated = tabulated_rod(film, rod, load, sticking=friction > 0)
    return tabulated or indent(film, rod, load=load, friction=friction)


def stick_and_slide(film: ElasticFilm, rod: Rod, load: float) -> tuple[Contact, Contact]:
    """Press a rod that sticks, and one that slides, on a neo-Hookean film."""
    rubber = replace(film, law=NEO_HOOKEAN, mooney_rivlin_ratio=None)
    # A film that slides is drawn out from under the rod, and is not solved to any depth.
    end = min(load, 0.999 * largest_tabulated_load(rubber, rod, sticking=False)) or load
    return press_rod(rubber, rod, end, math.inf), press_rod(rubber, rod, end, 0.0)


def _midway(film: ElasticFilm, rod: Rod, load: float) -> Contact:
    """Return the rod midway between sticking and sliding; sticking where no sliding is solved."""
    sticks = press_rod(film, rod, load, math.inf)
    try:
        ends = stick_and_slide(film, rod, load)
    except UNSOLVED:
        return sticks
    # Per newton the difference grows in proportion to the load.
    half = (load / ends[0].load) ** 2 / 2
    k = base_wavenumbers(film)
    transforms = []
    for order in (0, 1):
        own, more, less = (c.inside.spectrum(k, order) for c in (sticks, *ends))
        transforms.append(own - half * (more - less))
    field = TabulatedField(k, np.array(transforms), rod.radius)
    middle = f"{sticks.discretisation}, midway between sticking and sliding"
    return replace(sticks, inside=field, friction=math.nan, discretisation=middle)


def is_tabulated(
    film: ElasticFilm, rod: RoundIndenter, load: float, friction: float | None = None
) -> bool:
    """Whether a neo-Hookean film is found in the table, in milliseconds; else it is solved."""
    sticking = friction is None or friction > 0
    return isinstance(rod, Rod) and load <= largest_tabulated_load(film, rod, sticking=sticking)
