"""One importer a recording format."""
