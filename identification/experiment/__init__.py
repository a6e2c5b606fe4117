"""What a run identifies: Fisher information of its parameters, and which of several plants made
it."""
