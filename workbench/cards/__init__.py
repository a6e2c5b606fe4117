"""Cards: what a machine is and how its logs are to be read; recipes, units, effects' values."""
