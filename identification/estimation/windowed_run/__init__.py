"""A plant with effects from its free run in windows that begin at measured states."""
