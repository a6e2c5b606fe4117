"""The log that a machine would have made by a recipe, and what only its maker knows."""
