"""Lateral pinch: a card that stands in a slot, between the thumb's pad and the side of the index finger, as a key."""

from envs.grasps.grasp_type import Box, Contact, GraspType, Pads

GRASP = GraspType(
    name="lateral",
    object_kind="box",
    object_size=((0.040, 0.0014, 0.025), (0.046, 0.0016, 0.029)),
    object_mass=(0.05, 0.25),
    object_friction=(0.8, 1.0),
    support=(
        Box((0.03, 0.004, 0.0075), (0.0, 0.0065, 0.0075)),
        Box((0.03, 0.004, 0.0075), (0.0, -0.0065, 0.0075)),
    ),
    contacts=(
        Contact("thumb3", 0.7, (0.0, 1.0, 0.0), (-0.018, 0.0, 0.013)),
        Contact("index2", 0.15, (0.0, -1.0, 0.0), (-0.013, 0.0, 0.020)),
        Contact("index2", 0.85, (0.0, -1.0, 0.0), (-0.024, 0.0, 0.006)),
    ),
    posture=(
        *(-0.06, 1.11, 1.27, 0.60),
        *(0.00, 0.95, 1.15, 0.60),
        *(0.00, 1.05, 1.15, 0.60),
        *(0.00, 0.95, 1.15, 0.60),
        *(-0.33, -0.11, 0.35, 0.12),
    ),
    # palm down, fingers along world +x, thumb towards world +y
    wrist_rotation=((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    approach=(0.0, -0.006, 0.07),
    closing=Pads(opening=0.015, force=10.0),
    lift=(0.11, 0.15),
    carry=(0.06, 0.10),
    turn=(0.35, 0.52),
)
