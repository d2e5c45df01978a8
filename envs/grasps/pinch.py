"""Precision pinch: thumb against index and middle finger, on a small cube."""

from envs.grasps.grasp_type import Box, Contact, GraspType, Pads

GRASP = GraspType(
    name="pinch",
    object_kind="box",
    object_size=((0.0150, 0.0150, 0.0150), (0.0190, 0.0190, 0.0190)),
    object_mass=(0.1, 0.5),
    object_friction=(0.8, 1.0),
    support=(Box((0.03, 0.03, 0.015), (0.0, 0.0, 0.015)),),
    rest=0.03,
    contacts=(
        Contact("thumb3", 0.75, (-1.0, 0.0, 0.0)),
        Contact("index3", 0.75, (1.0, 0.0, 0.0), (0.0, 0.0085, 0.0)),
        Contact("middle3", 0.75, (1.0, 0.0, 0.0), (0.0, -0.0085, 0.0)),
    ),
    posture=(
        *(0.34, 0.74, 0.72, 0.34),
        *(-0.29, 0.69, 1.00, 0.50),
        *(0.00, 0.20, 0.22, 0.26),
        *(0.00, 0.25, 0.27, 0.27),
        *(-0.04, 0.58, 0.05, -0.04),
    ),
    # palm down, fingers along world +x and tilted 35 degrees towards the table
    wrist_rotation=((-0.819, 0.574, 0.0), (0.0, 0.0, 1.0), (0.574, 0.819, 0.0)),
    approach=(0.0, 0.0, 0.07),
    closing=Pads(opening=0.015, force=12.0),
    lift=(0.10, 0.15),
    carry=(0.06, 0.10),
    turn=(0.35, 0.52),
)
