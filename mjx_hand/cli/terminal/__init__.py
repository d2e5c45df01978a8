"""How commands end on a terminal: wrong command lines and Ctrl-C in one line."""
