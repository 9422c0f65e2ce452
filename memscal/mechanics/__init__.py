"""Linear elasticity of a bonded film: what an indenter on top does at the base."""
