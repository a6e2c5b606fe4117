"""The registry: models, designs, validations, logs and decisions of machines, append-only."""
