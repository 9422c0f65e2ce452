"""Places of the readings of a scan: which readings share one, and the lattice of a raster."""

import numpy as np
from numpy.typing import NDArray

from memscal.model.arrays import FloatArray, IndexArray
from memscal.model.places import EvenAxis, Places

#: Readings share a place where they are closer than this share of the distance that nine tenths
#: of the readings of a pass keep from each other; a few may be read twice in one.
_CLOSE = 0.1
_TWICE = 0.1
#: Of many passes over a plane there are too many pairs of readings: positions are rounded to this
#: share of what is close where there may be more pairs.
_GRAIN = 0.1
_MOST_PAIRS = 20_000_000
#: Distances below a nanometre are rounding.
_ROUNDING = 1e-9
#: Rows and columns make a raster if they cross at no more than this many nodes for each place.
_MOST_NODES = 4
#: Largest distance of a reading from its node of an even lattice, over the lattice's step.
_OFF_LATTICE = 0.1
_CANDIDATES = 200


def places_of(x: FloatArray, y: FloatArray, repeat: IndexArray) -> Places:
    """Group points by place: equal positions, and of several passes those close to each other."""
    # Close is a tenth of the usual distance within a pass. On a plane the readings at one node of
    # an even lattice share a place too.
    close = _close(x, y, repeat)
    columns, step_x = clusters(x, close)
    rows, step_y = clusters(y, close)
    # Along a line the neighbours of a place are those in order.
    width = np.ptp(x)
    height = np.ptp(y)
    index = rows if height else columns
    if width and height:
        index = _linked(x, y, close, int(np.ptp(repeat)) + 1)
    count = int(index.max()) + 1
    if 0.0 in (step_x, step_y) or _nodes(columns, rows) <= _MOST_NODES * count:
        return Places(index, rows, (step_x, step_y))
    lattice = even_lattice(x, y, count)
    if lattice is not None:
        along_x, along_y = lattice
        nodes = along_x.index * (int(along_y.index.max()) + 1) + along_y.index
        index = np.unique(nodes, return_inverse=True)[1]
        return Places(index, along_y.index, (along_x.step, along_y.step))
    # No rows and columns: every place stands for an equal share of the plane.
    step = float(np.sqrt(width * height / count))
    return Places(index, np.floor((y - y.min()) / step).astype(np.intp), (step, step))


def even_lattice(x: FloatArray, y: FloatArray, count: int) -> tuple[EvenAxis, EvenAxis] | None:
    """Fit an even lattice to the positions of ``count`` places in a plane, or return ``None``."""
    # Rows may be missing, but not most nodes: all positions lie on a lattice that is fine enough.
    along_x = _even_axis(x)
    along_y = _even_axis(y)
    if along_x is None or along_y is None:
        return None
    few = _nodes(along_x.index, along_y.index) <= _MOST_NODES * count
    return (along_x, along_y) if few else None


def _even_axis(positions: FloatArray) -> EvenAxis | None:
    """Fit the coarsest even lattice through all positions; steps are counted between them."""
    order = np.argsort(positions, kind="stable")
    ordered = positions[order]
    gaps = np.diff(ordered)
    # One of the gaps is about the step; the others are noise and missing rows.
    candidates = np.unique(gaps[gaps > max(_ROUNDING, 1e-9 * np.ptp(positions))])[::-1]
    if candidates.size > _CANDIDATES:
        candidates = candidates[np.geomspace(1, candidates.size, _CANDIDATES).astype(int) - 1]
    for candidate in candidates:
        number = np.append(0, np.cumsum(np.rint(gaps / candidate)))
        centred = number - number.mean()
        step = centred @ (ordered - ordered.mean()) / max(centred @ centred, 1.0)
        start = ordered.mean() - step * number.mean()
        if step > 0 and np.abs(ordered - start - step * number).max() <= _OFF_LATTICE * step:
            index = np.empty(positions.size, dtype=np.intp)
            index[order] = number
            return EvenAxis(start, step, index)
    return None


def _close(x: FloatArray, y: FloatArray, repeat: IndexArray) -> float:
    """Return the distance within which readings of several passes share a place; 0 of one pass."""
    order = np.argsort(repeat, kind="stable")
    starts = np.flatnonzero(np.diff(repeat[order])) + 1
    if not starts.size:
        return 0.0
    usual = []
    for chosen in np.split(order, starts):
        # Without an index unique() hashes, which is slower.
        places = np.unique(x[chosen] + 1j * y[chosen], return_index=True)[0]
        if places.size > 1:
            usual.append(np.quantile(_nearest(places), _TWICE, method="lower"))
    return max(_CLOSE * min(usual, default=0.0), _ROUNDING)


def _nearest(places: NDArray[np.complex128]) -> FloatArray:
    """Return the distance of each of several distinct positions x + iy to its nearest one."""
    from scipy.spatial import KDTree

    plane = places.view(np.float64).reshape(-1, 2)
    return np.asarray(KDTree(plane).query(plane, k=[2])[0])[:, 0]


def _linked(x: FloatArray, y: FloatArray, close: float, passes: int) -> IndexArray:
    """Number the groups of positions in a plane that are equal or, through others, close."""
    places, index = np.unique(x + 1j * y, return_inverse=True)
    if not close:
        return index
    if places.size * passes > _MOST_PAIRS:
        rounded = np.rint(places / (close * _GRAIN)) * (close * _GRAIN)
        places, coarse = np.unique(rounded, return_inverse=True)
        index = coarse[index]
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    pairs = KDTree(places.view(np.float64).reshape(-1, 2)).query_pairs(close, output_type="ndarray")
    links = coo_array((np.ones(len(pairs), bool), pairs.T), shape=(places.size, places.size))
    return np.asarray(connected_components(links, directed=False)[1][index], dtype=np.intp)


def clusters(values: FloatArray, gap: float) -> tuple[IndexArray, float]:
    """Number groups of values, in order, that no gap wider than ``gap`` parts; and their step."""
    order = np.argsort(values, kind="stable")
    index = np.empty(values.size, dtype=np.intp)
    index[order] = np.append(0, np.cumsum(np.diff(values[order]) > gap))
    means = np.bincount(index, values) / np.bincount(index)
    return index, float(np.median(np.diff(means))) if means.size > 1 else 0.0


def _nodes(columns: IndexArray, rows: IndexArray) -> int:
    return (int(columns.max()) + 1) * (int(rows.max()) + 1)
