"""Where a hand's keypoints come from: recordings, sockets, headsets, cameras."""
