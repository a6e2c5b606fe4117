"""A model and a machine's limits -> the run to make next, and what it promises."""
