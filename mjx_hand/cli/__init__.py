"""The command `mjx-hand`, one module a subcommand."""
