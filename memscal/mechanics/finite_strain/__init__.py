"""The neo-Hookean film at finite strain."""
