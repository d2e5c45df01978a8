"""Builds the open hand from the MakeHuman body (mjx_hand/hand/PROVENANCE.md)."""
