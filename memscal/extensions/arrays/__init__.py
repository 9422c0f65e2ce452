"""Arrays of sensors under one film: crosstalk, places, forces."""
