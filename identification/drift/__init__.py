"""Whether a machine has changed since its model: one log, and the mean over many."""
