"""Controllers for a model: placed, compared, recommended, scheduled and validated."""
