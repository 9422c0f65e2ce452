"""From a scan to a radial profile with its uncertainty, in data space."""
