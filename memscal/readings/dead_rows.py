"""Rows and columns at the edge of a raster that were never read: all their readings are zero."""

import numpy as np

from memscal.model.arrays import BoolArray, Columns
from memscal.readings.find_places import places_of

#: A row has at least so many positions; of the row beside dead ones more than this share is alive.
_FEWEST = 3
_ALIVE = 0.75


def without_dead_rows(columns: Columns, notes: list[str]) -> Columns:
    """Leave the rows and columns at the edges of a plane out that hold zeros alone; name them."""
    for along, across in (("y", "x"), ("x", "y")):
        if "y" in columns and np.any(columns["u_zz"] == 0):
            dead = _dead(columns, along, across)
            if dead.any():
                places = 1e3 * columns[along][dead]
                notes.append(
                    f"Left out, as rows of zeros at the edge: {dead.sum()} readings at {along} "
                    f"from {places.min():.4g} to {places.max():.4g} mm."
                )
                columns = {name: values[~dead] for name, values in columns.items()}
    return columns


def _dead(columns: Columns, along: str, across: str) -> BoolArray:
    """Mark the readings, (n,), of the rows from either end on that hold zeros alone."""
    zero = columns["u_zz"] == 0
    passes = columns.get("repeat", np.zeros(zero.size, dtype=np.intp))
    rows = places_of(columns[across], columns[along], passes).row
    dead = np.zeros(zero.size, dtype=bool)
    count = int(rows.max()) + 1
    for numbers in (range(count), range(count)[::-1]):
        marked = np.zeros_like(dead)
        for number in numbers:
            row = rows == number
            if np.unique(columns[across][row]).size < _FEWEST or not zero[row].all():
                # Zeros that fade into readings are a signal that ends.
                if zero[row].mean() < 1 - _ALIVE:
                    dead |= marked
                break
            marked |= row
    return dead
