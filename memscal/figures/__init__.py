"""Figures by matplotlib, and the report as an HTML page."""

FIGURE_SUFFIXES = (".png", ".svg", ".pdf")
"""What a figure's file name may end in; here, where no figure's library is imported."""
