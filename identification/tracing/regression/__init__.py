"""Which effects the equations call for: rows, candidates, forward choice, significance."""
