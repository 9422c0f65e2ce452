r"""Contours of rigid indenters, along which the surface of a film at finite strain slides.

A contour is a curve :math:`(r(s), z(s))` over its arc length from the lowest point, with z upward
from there.  All lengths are in mm.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from memscal.model.validation import FloatArray

__all__ = ["Face", "RodFace", "SphereFace"]


class Face(Protocol):
    """The contour of an indenter."""

    def contour(self, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the points at ``s`` and their first and second derivatives, shapes (2, n)."""

    def nearest(self, r: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return where on the contour is nearest, and how far outside a point is (or inside)."""


@dataclass(frozen=True)
class RodFace:
    """A rod: its end, its rounded edge, and its side wall, which the film drapes itself against.

    Parameters
    ----------
    radius : float
        Radius of the rod.
    edge : float
        Radius of the rounding of its edge.
    """

    radius: float
    edge: float

    @property
    def flat(self) -> float:
        """Radius of the flat part of the end: the contour is straight up to there."""
        return self.radius - self.edge

    def contour(self, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return points, tangents and curvature vectors."""
        angle = np.clip((s - self.flat) / self.edge, 0.0, np.pi / 2)
        sine, cosine = np.sin(angle), np.cos(angle)
        wall = np.maximum(s - self.flat - np.pi / 2 * self.edge, 0.0)
        rise = 2 * self.edge * np.sin(angle / 2) ** 2
        points = np.stack([np.minimum(s, self.flat) + self.edge * sine, rise + wall])
        bend = np.where((angle > 0) & (angle < np.pi / 2), 1 / self.edge, 0.0)
        return points, np.stack([cosine, sine]), np.stack([-sine * bend, cosine * bend])

    def nearest(self, r: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the arc length of the nearest point, and the distance outside it."""
        x, y = r - self.flat, self.edge - z  # outward and downward from the rounding's centre
        wall = np.where((x <= 0) & (y <= 0), x > y, x > 0)
        s = np.where(wall, self.flat + np.pi / 2 * self.edge - y, r)
        turning = (x > 0) & (y > 0)
        s = np.where(turning, self.flat + self.edge * np.arctan2(x, y), s)
        straight = np.where(wall, x, y)
        return s, np.where(turning, np.hypot(x, y), straight) - self.edge


@dataclass(frozen=True)
class SphereFace:
    """A sphere of this radius of curvature."""

    radius: float

    def contour(self, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return points, tangents and curvature vectors."""
        sine, cosine = np.sin(s / self.radius), np.cos(s / self.radius)
        height = 2 * self.radius * np.sin(s / (2 * self.radius)) ** 2
        points = np.stack([self.radius * sine, height])
        return points, np.stack([cosine, sine]), np.stack([-sine, cosine]) / self.radius

    def nearest(self, r: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the arc length of the nearest point, and the distance outside it."""
        away = np.hypot(r, self.radius - z)
        # The difference to the radius, without cancellation.
        gap = (r**2 + z**2 - 2 * self.radius * z) / (away + self.radius)
        return self.radius * np.arctan2(r, self.radius - z), gap
