"""Division of the voltage field by the stress field, on arrays."""
