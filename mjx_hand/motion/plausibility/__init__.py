"""The gate that every result passes before it is written: what no hand does is refused, what is doubtful is said."""
