"""Effects that the equations show (`../README.md`): rows, candidates, selection, significance."""
