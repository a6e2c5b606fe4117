"""The nine parameters from the simulated response: search, refinement, weighing (`README.md`)."""
