"""The twin: the person's hand, where it is told to be, and the world that it acts in."""
