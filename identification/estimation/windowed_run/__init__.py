"""A plant with effects from its free run in windows from measured states (`README.md`)."""
