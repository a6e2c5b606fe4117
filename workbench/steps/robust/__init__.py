"""Designs that hold for the machine there is: judged over machines drawn from what is not sure."""
