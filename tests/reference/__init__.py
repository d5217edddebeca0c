"""Slow, obvious oracles in plain Python: written from the definitions, sharing nothing with the kernels."""
