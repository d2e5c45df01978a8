"""The live twin, measured: where its time goes, and what it holds."""
