"""What `launch/benchmark.py` measures; each yields (name, value) lines."""
