"""From measured contact scans to friction: calculated profiles, and what the data say of them."""
