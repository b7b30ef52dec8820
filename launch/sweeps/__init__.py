"""What `launch/sweep.py` runs: which runs, where, until all are done."""
