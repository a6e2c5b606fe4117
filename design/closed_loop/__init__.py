"""A design in its loop on a machine: linear plants, simulated runs, and what they come to."""
