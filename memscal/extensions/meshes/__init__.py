"""Meshes with fields: read and written through meshio, and what memscal needs of them."""
