"""A valve and cylinder whose velocity follows the command: model, fit, rivals."""
