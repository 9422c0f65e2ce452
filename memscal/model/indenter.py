"""Rigid axisymmetric indenters."""

from __future__ import annotations

from dataclasses import dataclass

from memscal.model.validation import require_non_negative, require_positive

__all__ = ["Indenter", "Rod", "Sphere"]


@dataclass(frozen=True, kw_only=True)
class Indenter:
    """A rigid axisymmetric indenter, given by one radius.

    Parameters
    ----------
    radius : float
        Radius of the rod, or radius of curvature of the sphere, in m.
    radius_uncertainty : float, optional
        Its standard uncertainty (k = 1), in m; ``None`` means "not stated".

    Raises
    ------
    InputError
        If the radius is not finite and positive.
    """

    radius: float
    radius_uncertainty: float | None = None

    def __post_init__(self) -> None:
        require_positive(f"{self.shape} radius", self.radius, "m")
        if self.radius_uncertainty is not None:
            require_non_negative(f"uncertainty of the {self.shape} radius", self.radius_uncertainty)

    @property
    def shape(self) -> str:
        """Name of the shape as it stands in files: ``"rod"`` or ``"sphere"``."""
        return type(self).__name__.lower()


@dataclass(frozen=True, kw_only=True)
class Rod(Indenter):
    """A rigid flat-ended cylinder, the indenter of the calibration scan.

    Examples
    --------
    >>> Rod(radius=0.25e-3).shape
    'rod'
    """


@dataclass(frozen=True, kw_only=True)
class Sphere(Indenter):
    """A rigid sphere, the indenter of the contact scans; ``radius`` is its curvature's.

    Examples
    --------
    >>> Sphere(radius=128.8e-3).shape
    'sphere'
    """
