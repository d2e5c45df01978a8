"""Policies for other programs: ONNX, NumPy or C, with a contract, and scenes and references to play them in."""
