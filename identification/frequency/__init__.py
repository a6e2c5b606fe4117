"""Frequency responses of a machine from its logs: averaged spectra, bands, resonances."""
