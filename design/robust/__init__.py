"""Designs that hold for the machine there is: tested over machines drawn from what is not sure."""
