"""One machine as values: its model, its design, and their written form with units."""
