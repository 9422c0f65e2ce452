"""Laws of the interface compared by how well each explains the measured stress."""
