"""ARX models: estimate, prediction, order and delay, tests of what they leave."""
