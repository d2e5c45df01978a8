"""One reader a marker file format."""
