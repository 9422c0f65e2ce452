"""Figures and the report: the only room that draws.

Nothing is imported here, so that naming the package costs nothing; take
``memscal.figures.calibration``, ``.sweep``, ``.report`` or ``.save`` where they are needed.
"""
