"""Pure numerics: signals, friction, simulation, fits."""
