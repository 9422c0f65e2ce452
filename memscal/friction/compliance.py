"""Laws of the interface against an effective friction coefficient, by evidence."""

from __future__ import annotations

from memscal.friction.compliance_results import InterfaceComparison

__all__ = ["InterfaceComparison"]
