"""Which column of a log is which signal: by what its header means, and by what the columns do."""
