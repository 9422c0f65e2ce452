"""Response of a sensor under its film: which waves of pressure it resolves, and how small ones."""
