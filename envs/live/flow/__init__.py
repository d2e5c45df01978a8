"""What goes from stage to stage, where only the newest counts, and how long each stage takes."""
