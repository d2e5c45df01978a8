"""The hand's skin cut into links: borders along smooth curves, domes that close them."""
