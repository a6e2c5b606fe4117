"""What every effect must hold to: on its declaration and kernels alone, and in a run."""
