"""The run to make next: a reference within the machine's limits that is most informative."""
