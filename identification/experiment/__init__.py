"""What a run tells: Fisher information of its parameters, and which of several plants made it."""
