"""Small ball: thumb against index and middle finger, which stand apart and hold it from a little below its middle."""

from envs.grasps.grasp_type import Box, Contact, GraspType, Pads

GRASP = GraspType(
    name="small_ball",
    object_kind="sphere",
    object_size=((0.0130, 0.0, 0.0), (0.0175, 0.0, 0.0)),
    object_mass=(0.03, 0.15),
    object_friction=(0.8, 1.0),
    # a frame of four slats, which the ball dips into a little
    support=(
        Box((0.014, 0.004, 0.018), (0.0, 0.011, 0.018)),
        Box((0.014, 0.004, 0.018), (0.0, -0.011, 0.018)),
        Box((0.004, 0.007, 0.018), (0.011, 0.0, 0.018)),
        Box((0.004, 0.007, 0.018), (-0.011, 0.0, 0.018)),
    ),
    rest=0.034,
    contacts=(
        Contact("thumb3", 0.75, (-(0.91**0.5), 0.0, -0.3)),
        Contact("index3", 0.75, (0.66**0.5, 0.5, -0.3)),
        Contact("middle3", 0.75, (0.66**0.5, -0.5, -0.3)),
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
    closing=Pads(opening=0.015, force=6.0),
    lift=(0.10, 0.15),
    carry=(0.06, 0.10),
    turn=(0.35, 0.52),
)
