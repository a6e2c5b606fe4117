"""Code for a machine: a design as C, Structured Text, PLCopen XML, FMU, JSON or MAT."""
