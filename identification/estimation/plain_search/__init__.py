"""The nine parameters searched on simulated runs of many plants at once (`README.md`)."""
