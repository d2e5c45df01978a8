"""What goes out: the page, the poses that it shows, and the twin's state for other programs."""
