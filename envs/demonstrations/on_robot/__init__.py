"""A person's demonstration brought onto a robot hand: what touches in it touches the object at the same places."""
