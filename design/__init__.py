"""Controllers by pole placement, margins, the loop in simulation."""
