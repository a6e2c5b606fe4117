"""The equations of a machine as weighted rows, and what they alone tell of its parameters."""
