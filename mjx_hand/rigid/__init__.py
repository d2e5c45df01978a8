"""The rigid hand: its links, hinges, limits and shapes."""
