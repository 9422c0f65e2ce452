"""Calibration from scans to the artifact: steps, uncertainty, checks, and many scans."""
