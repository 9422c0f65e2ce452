"""The content of a file before it is written: groups, numbers with units, and text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from memscal.formats.units import from_si

__all__ = ["Group", "Node", "Number", "count", "index_axis", "note", "si", "walk"]

Attribute = str | int | tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Number:
    """A scalar or array in the unit of the file; ``axes`` names its axes, found in its group."""

    values: NDArray[np.float64] | NDArray[np.int64]
    units: str
    axes: tuple[str, ...] = ()
    attributes: Mapping[str, Attribute] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Group:
    """A NeXus group; an attribute whose value is empty text is left out when it is written."""

    nx_class: str
    children: Mapping[str, Node]
    attributes: Mapping[str, Attribute] = field(default_factory=dict)

    @property
    def all_attributes(self) -> dict[str, Attribute]:
        """The attributes, the class first, and for NXdata the index of each axis."""
        found: dict[str, Attribute] = {"NX_class": self.nx_class, **self.attributes}
        axes = self.attributes.get("axes", ())
        if isinstance(axes, tuple):
            found |= {f"{axis}_indices": i for i, axis in enumerate(axes)}
        return found


Node = Group | Number | str


def si(values: ArrayLike, dimension: str, axes: tuple[str, ...] = ()) -> Number:
    """Return SI values as a number in the unit that our files use for their dimension."""
    converted, units = from_si(values, dimension)
    return Number(converted, units, axes)


def count(value: int) -> Number:
    """Return a whole number, or a truth value as 0 or 1."""
    return Number(np.asarray(value, dtype=np.int64), "1")


def index_axis(name: str, size: int) -> Number:
    """Return an axis that only counts: repeats, or the parameters of a covariance."""
    return Number(np.arange(size, dtype=np.int64), "1", (name,))


def note(text: str, *, media_type: str = "text/plain", description: str = "") -> Group:
    """Return text as an NXnote."""
    children: dict[str, Node] = {"type": media_type, "data": text}
    if description:
        children["description"] = description
    return Group("NXnote", children)


def walk(root: Group, path: str = "") -> Iterator[tuple[str, Node]]:
    """Yield every node with its path, parents first, the root as ``"/"``."""
    yield path or "/", root
    for name, child in root.children.items():
        if isinstance(child, Group):
            yield from walk(child, f"{path}/{name}")
        else:
            yield f"{path}/{name}", child
