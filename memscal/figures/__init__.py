"""Figures and the report: the only room that draws."""
