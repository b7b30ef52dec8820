"""Video frames and files."""
