"""Checks of a scan beside its voltages: the noise's correlation, its contacts, its plane."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from memscal.errors import InputError
from memscal.model.validation import FloatArray, frozen_array

__all__ = ["LUBRICATIONS", "checked_correlation", "require_contacts", "require_plane"]

LUBRICATIONS = ("", "dry", "lubricated")
"""What can be between indenter and film; empty where a scan does not say."""

#: A combination of voltages with less of the noise than this would outweigh all others.
_LEAST_EIGENVALUE = 1e-8
#: Points that spread by less of their length across it are a line.
_LINE = 0.01


class _Contacts(Protocol):
    """What of a scan describes its contacts."""

    @property
    def normal_load(self) -> FloatArray | None: ...
    @property
    def normal_load_errors(self) -> FloatArray | None: ...
    @property
    def lubrication(self) -> str: ...
    @property
    def lubricant(self) -> str: ...


def require_contacts(scan: _Contacts) -> None:
    """Refuse uncertainties of loads that are none, and an unknown state of lubrication.

    Raises
    ------
    InputError
        If an uncertainty is negative or infinite, or stands without its load, or if the
        lubrication is unknown, or contradicts the lubricant.
    """
    errors = scan.normal_load_errors
    if errors is not None:
        if scan.normal_load is None:
            raise InputError(
                "normal_load_errors is given without normal_load.",
                why="It is the standard uncertainty of the load at each point.",
                cure="Give normal_load too, the load that was set at each point.",
            )
        if np.any((errors < 0) | np.isinf(errors)):
            raise InputError(
                "normal_load_errors holds a standard uncertainty that is negative or infinite."
            )
    if scan.lubrication not in LUBRICATIONS:
        raise InputError(
            f"The lubrication of the scan is {scan.lubrication!r}.",
            cure="Give 'dry' or 'lubricated', or leave it out.",
        )
    if scan.lubricant and scan.lubrication != "lubricated":
        stated = scan.lubrication or "not stated"
        raise InputError(
            f"The scan names a lubricant, {scan.lubricant!r}, but its lubrication is {stated}.",
            cure="Give the lubrication 'lubricated', or leave the lubricant out.",
        )


def checked_correlation(given: ArrayLike, size: int) -> FloatArray:
    """Return a read-only copy of a correlation of ``size`` points; refuse what no noise can have.

    Raises
    ------
    InputError
        If it has another shape, is no correlation, or is not positive definite.

    Examples
    --------
    >>> checked_correlation([[1.0, 0.5], [0.5, 1.0]], 2).shape
    (2, 2)
    """
    found = frozen_array(given)
    if found.shape != (size, size) or not np.isfinite(found).all():
        raise InputError(
            f"u_zz_correlation has shape {found.shape}, but it should be ({size}, {size}) and "
            "finite.",
            why="It correlates every point of one repeat with every other.",
        )
    if not np.allclose(found, found.T, atol=1e-9) or not np.allclose(np.diag(found), 1.0):
        raise InputError(
            "u_zz_correlation is not a correlation: not symmetric, or not one on its diagonal.",
            cure="Divide a covariance by the standard uncertainties of row and column, and "
            "give those as u_zz_errors.",
        )
    least = float(np.linalg.eigvalsh(found)[0])
    if least <= _LEAST_EIGENVALUE:
        raise InputError(
            f"u_zz_correlation is not positive definite: it has the eigenvalue {least:.3g}.",
            why="Some combination of the voltages would have no noise, or less than none.",
            cure="Add the electronic noise, which is independent from point to point.",
        )
    return found


def require_plane(x: FloatArray, y: FloatArray) -> None:
    """Refuse points of a plane that lie along a line: they tell no centre across it."""
    spread = float(np.ptp(x)), float(np.ptp(y))
    thin = int(np.argmin(spread))
    if spread[thin] <= _LINE * spread[1 - thin]:
        raise InputError(
            f"The points spread over {spread[0] * 1e3:.4g} mm along x and {spread[1] * 1e3:.4g} mm "
            "along y.",
            why=f"With less than {_LINE:.0%} of the one along the other they are a line, which "
            "tells no centre across it.",
            cure="Leave y out." if thin else "Give the positions along y as x; direction='y'.",
        )
