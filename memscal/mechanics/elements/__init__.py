"""The bonded film by finite elements, with a free edge where it ends."""
