"""A first card for a log: columns, units, signs and rig, each with its reason."""
