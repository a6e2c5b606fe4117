"""From residual to missing effect: choice, run, verdict."""
