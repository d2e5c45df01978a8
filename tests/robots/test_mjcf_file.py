"""Hands from MJCF: the little hand written as MJCF moves as its own kinematics say; what of a file is refused."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from mjx_hand.bodies.body_places import body_model
from mjx_hand.bodies.robot_body import robot_body
from mjx_hand.cli.main import main
from mjx_hand.errors import InputError
from mjx_hand.robots.mjcf_file import read_mjcf
from tests.robots import little_hand

_DESCRIPTION = """
mjcf: little.xml
palm: palm
tips: {thumb_end: thumb_tip, index_end: index_tip, middle_end: middle_tip, ring_end: ring_tip}
scaling: 1.0
fingers: [0, 0, 1]
palmar: [1, 0, 0]
"""


def digit(name: str) -> str:
    """Three links, the last of which follows; its joints stand where links begin, its end is a site."""
    along = little_hand.direction(name)
    axis = " ".join(map(str, np.cross(along, [1.0, 0, 0])))
    place = lambda point: " ".join(map(str, point))  # noqa: E731
    first, middle, last = (length * along for length in little_hand.LENGTHS)
    hinge = f"axis='{axis}' range='0 {little_hand.LIMIT}'"
    shape = "<geom type='capsule' fromto='0 0 0 {}' size='0.006'/>"
    return f"""
    <body name='{name}_base' pos='{place(little_hand.BASES[name])}'>
      <joint name='{name}_one' {hinge} actuatorfrcrange='-0.4 0.4'/>{shape.format(place(first))}
      <body name='{name}_middle' pos='{place(first)}'>
        <joint name='{name}_two' {hinge}/>{shape.format(place(middle))}
        <body name='{name}_last'>
          <joint name='{name}_three' pos='{place(middle)}' {hinge}/>
          <geom type='capsule' fromto='{place(middle)} {place(middle + last)}' size='0.006'/>
          <site name='{name}_end' pos='{place(middle + last)}'/>
        </body>
      </body>
    </body>"""


def mjcf(change=lambda text: text) -> str:
    """The little hand on a table with a ball, which are no part of it."""
    ties = "".join(
        f"<joint joint1='{d}_three' joint2='{d}_two' polycoef='0 {little_hand.FOLLOW} 0 0 0'/>"
        for d in little_hand.DIGITS
    )
    text = f"""<mujoco><compiler angle='radian'/><default><joint type='hinge'/></default><worldbody>
      <geom name='floor' type='plane' size='1 1 1'/>
      <body name='ball' pos='0.3 0 0'><freejoint/><geom size='0.02'/></body>
      <body name='palm'><geom type='box' size='0.01 0.04 0.04' pos='0 0 0.045'/>
      {"".join(map(digit, little_hand.DIGITS))}</body>
    </worldbody><equality>{ties}</equality>
    <actuator><position joint='index_two' forcerange='-0.3 0.2' gear='2'/></actuator></mujoco>"""
    return change(text)


def write(folder: Path, change=lambda text: text) -> Path:
    (folder / "little.xml").write_text(mjcf(change))
    (folder / "little.yaml").write_text(_DESCRIPTION)
    return folder / "little.yaml"


def test_the_hand_moves_as_its_own_kinematics_say(tmp_path):
    body = robot_body(write(tmp_path))
    assert (body.side, len(body.joints), len(body.coupled)) == ("right", 8, 4)
    tips, wanted = little_hand.tips_of(body, "{}_one", "{}_two")
    np.testing.assert_allclose(tips, wanted, atol=1e-6)
    limits = dict(zip(body.joints, body.gains.force_limit, strict=True))
    assert limits["index_one"] == pytest.approx(0.4)
    assert limits["index_two"] == pytest.approx(0.6)  # 0.3 at a gear of 2
    shapes = body_model(body)
    assert (shapes.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE).sum() == 12
    assert "ball" not in {shapes.body(k).name for k in range(shapes.nbody)}


def test_a_joints_zero_is_where_the_file_is_drawn(tmp_path):
    """With `ref`, which is what the joint reads there, limits move along."""
    (tmp_path / "r.xml").write_text(
        "<mujoco><compiler angle='radian'/><worldbody><body name='a'><joint name='j' range='0.5 1.5' ref='0.7'/>"
        "<geom type='box' size='0.01 0.02 0.03' pos='0 0 0.03'/></body></worldbody></mujoco>"
    )
    robot = read_mjcf(tmp_path / "r.xml")
    (joint,) = (each for each in robot.joints if each.type != "fixed")
    assert joint.limit is not None
    assert (joint.limit.lower, joint.limit.upper) == pytest.approx((-0.2, 0.8))
    (tip,) = (each for each in robot.joints if each.child == "a_tip")  # the corner that is farthest from the joint
    np.testing.assert_allclose(np.abs(np.asarray(tip.origin)[:3, 3]), [0.01, 0.02, 0.06])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text[:200], "not an MJCF that MuJoCo can read|no such|not an MJCF"),
        (lambda text: text.replace("index_two' polycoef='0 0.7 0", "index_two' polycoef='0 0.7 0.1"), "is a curve"),
        (lambda text: text.replace("name='ring_one'", "name='ring_one' type='ball'", 1), "'ring_one' is a ball joint"),
        (
            lambda text: text.replace("joint name='ring_one'", "joint name='ring_one' type='slide' limited='false'"),
            "sl",
        ),
        (lambda text: text.replace("<geom size='0.02'/>", "<geom type='mesh' mesh='absent'/>"), "MuJoCo can read"),
        (lambda text: text.replace("ring_end", "ring_und"), "has no link 'ring_end'"),
        (lambda text: "<mujoco><worldbody><body><geom size='1'/></body></worldbody></mujoco>", "no body has a hinge"),
        (lambda text: "<robot name='a'><link name='b'/></robot>", "not an MJCF, whose first element is <mujoco>"),
    ],
)
def test_what_no_hand_can_be_made_of_is_refused_in_one_line(change, message, tmp_path):
    with pytest.raises(InputError, match=message) as refused:
        robot_body(write(tmp_path, change))
    assert "\n" not in str(refused.value)


def test_the_command_takes_an_mjcf_in_the_place_of_the_urdf(tmp_path, capsys):
    description = write(tmp_path)
    description.write_text(_DESCRIPTION.replace("mjcf: little.xml\n", ""))
    options = ["robot", "--robot", str(description), "--build", str(tmp_path / "o")]
    assert main([*options, "--mjcf", str(tmp_path / "little.xml")]) == 0
    assert "little, right: 8 actuated joints, 4 that follow others" in capsys.readouterr().out
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "o/little.xml")).nu == 14
    assert main([*options, "--mjcf", str(tmp_path / "absent.xml")]) == 2
    assert main([*options, "--mjcf", "a.xml", "--urdf", "b.urdf"]) == 2
    errors = capsys.readouterr().err.splitlines()
    assert [error.partition(": ")[2].split(";")[0] for error in errors] == [
        f"{tmp_path / 'absent.xml'}: no such file",
        "--urdf and --mjcf are given",
    ]
