"""Results as tables and as mappings, for the command line, notebooks and reports."""
