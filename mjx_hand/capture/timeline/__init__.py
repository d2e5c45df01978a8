"""When each row of a recording was taken: time stamps, frame numbers and the stated rate, compared with each other."""
