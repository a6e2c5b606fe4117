"""Parameters from logs: by regression, by the simulated response, by windows of the free run."""
