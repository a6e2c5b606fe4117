"""A card proposed for a log that none describes: its rig, its signals, and why; answers to it."""
