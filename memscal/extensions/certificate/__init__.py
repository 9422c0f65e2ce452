"""Certificates of calibration: their contents, their pages, and their XML."""
