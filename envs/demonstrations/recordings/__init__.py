"""From anyone's recording, with its objects, to demonstrations: no step knows the object."""
