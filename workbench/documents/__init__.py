"""What is written and read back: model.json and design.json."""
