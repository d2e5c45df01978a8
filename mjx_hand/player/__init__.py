"""An exported policy and what it needs to run: no JAX, only NumPy and MuJoCo."""
