"""Files that are safe to read and never half written, and arrays kept from one start to the next."""
