"""The nine parameters from whole runs by the command: search, refinement, weighing."""
