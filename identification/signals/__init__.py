"""Signals of a log: cleaned, checked, differentiated, in weak form, at the start."""
