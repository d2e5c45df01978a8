"""An experiment's environment and policies: made, chosen, rolled out."""
