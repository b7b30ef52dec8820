"""The commands: the composition root, and the only place with flags."""
