"""Places of measured points: which readings share one, how far apart they are, even lattices."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from memscal.model.arrays import FloatArray

IntArray = NDArray[np.intp]

#: Readings share a place where they are closer than this share of the distance that nine tenths
#: of the readings of a pass keep from each other; a few may be read twice in one.
_CLOSE = 0.1
_TWICE = 0.1
#: Distances below a nanometre are rounding.
_ROUNDING = 1e-9
#: Rows and columns make a raster if they cross at no more than this many nodes for each place.
_MOST_NODES = 4
#: Largest distance of a reading from its node of an even lattice, over the lattice's step.
_OFF_LATTICE = 0.1
_CANDIDATES = 200


@dataclass(frozen=True, eq=False)
class Places:
    """Places of the points of one scan.

    ``index`` (n,): the place of each point; ``row`` (n,): its row along y, 0 on a line; ``steps``
    (2,): typical distance of neighbours along x and y, in m, 0 along an axis without spread.
    """

    index: IntArray
    row: IntArray
    steps: tuple[float, float]

    @property
    def count(self) -> int:
        """How many places there are."""
        return int(self.index.max()) + 1

    @property
    def readings(self) -> IntArray:
        """Number of readings at the place of each point, shape (n,)."""
        return np.bincount(self.index)[self.index]


@dataclass(frozen=True, eq=False)
class EvenAxis:
    """An even lattice along one axis: ``start`` and ``step`` in m, ``index`` (n,) of each point."""

    start: float
    step: float
    index: IntArray


def places_of(x: FloatArray, y: FloatArray, repeat: IntArray) -> Places:
    """Group points by place: equal positions, and of several passes those close to each other.

    Close is a tenth of the usual distance within a pass.  On a plane the readings at one node of
    an even lattice share a place too.
    """
    positions = np.stack([x, y], axis=1)
    close, pairs = _neighbours(positions, repeat)
    index = _linked(positions, pairs)
    columns, rows = (_clusters(values, close) for values in (x, y))
    steps = _typical_step(x, columns), _typical_step(y, rows)
    count = int(index.max()) + 1
    if 0.0 in steps or _nodes(columns, rows) <= _MOST_NODES * count:
        return Places(index, rows, steps)
    lattice = even_lattice(x, y, count)
    if lattice is not None:
        along_x, along_y = lattice
        nodes = along_x.index * (int(along_y.index.max()) + 1) + along_y.index
        index = np.unique(nodes, return_inverse=True)[1]
        return Places(index, along_y.index, (along_x.step, along_y.step))
    # No rows and columns: every place stands for an equal share of the plane.
    step = float(np.sqrt(np.ptp(x) * np.ptp(y) / count))
    return Places(index, np.floor((y - y.min()) / step).astype(np.intp), (step, step))


def even_lattice(x: FloatArray, y: FloatArray, count: int) -> tuple[EvenAxis, EvenAxis] | None:
    """Fit an even lattice to the positions of ``count`` places in a plane, or return ``None``.

    Rows may be missing, but not most nodes: all positions lie on a lattice that is fine enough.
    """
    along_x, along_y = _even_axis(x), _even_axis(y)
    if along_x is None or along_y is None:
        return None
    few = _nodes(along_x.index, along_y.index) <= _MOST_NODES * count
    return (along_x, along_y) if few else None


def _even_axis(positions: FloatArray) -> EvenAxis | None:
    """Fit the coarsest even lattice that meets all positions; steps are counted between them."""
    order = np.argsort(positions, kind="stable")
    gaps = np.diff(positions[order])
    # One of the gaps is about the step; the others are noise and missing rows.
    candidates = np.unique(gaps[gaps > max(_ROUNDING, 1e-9 * np.ptp(positions))])[::-1]
    if candidates.size > _CANDIDATES:
        candidates = candidates[np.geomspace(1, candidates.size, _CANDIDATES).astype(int) - 1]
    for step in candidates:
        number = np.concatenate([[0], np.cumsum(np.rint(gaps / step))])
        axis = _fitted(positions[order], number)
        if axis is not None:
            index = np.empty(positions.size, dtype=np.intp)
            index[order] = axis.index
            return replace(axis, index=index)
    return None


def _fitted(ordered: FloatArray, number: FloatArray) -> EvenAxis | None:
    centred = number - number.mean()
    step = float(centred @ (ordered - ordered.mean()) / max(centred @ centred, 1.0))
    start = float(ordered.mean() - step * number.mean())
    if not step > 0 or np.abs(ordered - start - step * number).max() > _OFF_LATTICE * step:
        return None
    return EvenAxis(start, step, number.astype(np.intp))


def _neighbours(positions: FloatArray, repeat: IntArray) -> tuple[float, IntArray]:
    """Return which distance is close, and pairs of distinct positions that are."""
    passes = np.unique(repeat)
    if passes.size == 1:
        return 0.0, np.zeros((0, 2), dtype=np.intp)
    from scipy.spatial import KDTree

    usual = []
    for number in passes:
        places = np.unique(positions[repeat == number], axis=0)
        if len(places) > 1:
            distances = KDTree(places).query(places, k=[2])[0]
            usual.append(float(np.quantile(distances, _TWICE, method="lower")))
    close = max(_CLOSE * min(usual, default=0.0), _ROUNDING)
    distinct = np.unique(positions, axis=0)
    pairs = KDTree(distinct).query_pairs(close, output_type="ndarray")
    return close, np.asarray(pairs, dtype=np.intp)


def _linked(positions: FloatArray, pairs: IntArray) -> IntArray:
    """Number the groups of equal or paired positions; pairs index the distinct positions."""
    distinct, index = np.unique(positions, axis=0, return_inverse=True)
    index = index.reshape(-1)  # NumPy 2.0 kept an axis here
    if not len(pairs):
        return np.asarray(index)
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(distinct), len(distinct)))
    return np.asarray(connected_components(links, directed=False)[1][index], dtype=np.intp)


def _clusters(values: FloatArray, gap: float) -> IntArray:
    """Number groups of values, in order, that no gap wider than ``gap`` parts."""
    order = np.argsort(values, kind="stable")
    index = np.empty(values.size, dtype=np.intp)
    index[order] = np.concatenate([[0], np.cumsum(np.diff(values[order]) > gap)])
    return index


def _nodes(columns: IntArray, rows: IntArray) -> int:
    return (int(columns.max()) + 1) * (int(rows.max()) + 1)


def _typical_step(values: FloatArray, cluster: IntArray) -> float:
    means = np.bincount(cluster, values) / np.bincount(cluster)
    return float(np.median(np.diff(means))) if means.size > 1 else 0.0
