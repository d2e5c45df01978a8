"""Projection of a MANO pose's rotations onto the hinges of the rigid hand."""

from mjx_hand.projection.functional_axes import fit_functional_axes
from mjx_hand.projection.project import METHODS, project
from mjx_hand.projection.two_dof import project_one_dof, project_two_dof

__all__ = ["METHODS", "fit_functional_axes", "project", "project_one_dof", "project_two_dof"]
