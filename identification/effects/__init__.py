"""The library of effects: one file an effect, found by walking this folder (see `_library`)."""
