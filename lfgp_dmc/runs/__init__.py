"""A run: its loop, folder, checkpoints and logs."""
