"""The page of a maintenance team: the fleet, a machine, and a place to drop a log."""
