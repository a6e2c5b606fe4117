"""Results read back: model.json, design.json, those of a valve, what a trace leaves open."""
