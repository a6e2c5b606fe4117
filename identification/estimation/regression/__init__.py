"""The equations of a machine as weighted rows, and what they alone identify (`README.md`)."""
