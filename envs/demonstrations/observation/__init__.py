"""What a recording shows: where up is, when an object stands still, who moves it, and its way."""
