"""The film at finite strain, neo-Hookean or Mooney-Rivlin."""
