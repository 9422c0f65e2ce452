"""The contact of an indenter with a film, solved ring by ring."""
