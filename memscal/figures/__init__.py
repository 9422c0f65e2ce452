"""Figures by matplotlib, and the report as an HTML page."""
