"""Which column of a log is which signal, and in which unit: by what its header means, and by
what the columns do."""
