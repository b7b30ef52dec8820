"""What is stored: files, demonstrations, the replay."""
