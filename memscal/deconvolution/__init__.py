"""Division of the voltage field by the stress field: one regulariser per file."""
