"""What a command is told: configurations and options, devices and processes."""
