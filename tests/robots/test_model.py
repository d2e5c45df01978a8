"""A robot hand as physics has it, from a little URDF whose numbers are known, and what of a file is refused."""

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from mjx_hand.bodies.robot_body import robot_body
from mjx_hand.errors import InputError
from mjx_hand.robots.model.links import hand_links
from mjx_hand.robots.model.shapes import Shape, capsule, hull, off_the_mesh, shapes_of
from mjx_hand.robots.robot_hand import load_robot
from mjx_hand.robots.urdf_file import read_urdf
from tests.robots import little_hand

_SHAPE = "<collision><geometry><box size='0.012 0.012 0.03'/></geometry></collision>"


def write(folder: Path, change=lambda text: text, **options) -> tuple[Path, Path]:
    """The little hand with a box on every link."""
    urdf, description = little_hand.write(folder, **options)
    text = re.sub(r'<link name="(\w+)"/>', rf'<link name="\1">{_SHAPE}</link>', urdf.read_text())
    urdf.write_text(change(text))
    return urdf, description


@pytest.fixture(scope="module")
def little(tmp_path_factory):
    urdf, description = write(tmp_path_factory.mktemp("little"))
    return robot_body(description, urdf)


def test_the_hand_moves_as_its_urdf_says(little):
    """Tips where the little hand's own kinematics have them, in the axes of a person's wrist; ties kept."""
    assert little.side == "right"
    assert little.fingers == ("index", "middle", "ring", "thumb")
    assert len(little.joints) == 8
    assert len(little.coupled) == 4
    tips, wanted = little_hand.tips_of(little, "{}_base_joint", "{}_middle_joint")
    np.testing.assert_allclose(tips, wanted, atol=1e-6)


def test_actuators_reach_their_targets_and_ties_hold(little):
    model = little.spec().compile()
    model.opt.timestep, model.opt.integrator = 0.004, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.opt.gravity[:] = 0
    data = mujoco.MjData(model)
    data.ctrl[6:] = 0.5
    for _ in range(250):
        mujoco.mj_step(model, data)
    for name in little.joints:
        assert data.joint(name).qpos[0] == pytest.approx(0.5, abs=0.01)
    for tie in little.coupled:
        assert data.joint(tie.joint).qpos[0] == pytest.approx(0.7 * 0.5, abs=0.01)
    assert [model.actuator(k).name for k in range(model.nu)] == [*little.names.targets]


def test_the_rule_of_gains(tmp_path):
    """15 N at a finger tip unless the effort is less; the description goes first."""

    def weaker(text):
        return text.replace('lower="0" upper="1.6"', 'lower="0" upper="1.6" effort="0.2"', 1)

    urdf, description = write(tmp_path, weaker)
    description.write_text(description.read_text() + "force_limits: {index_base_joint: 0.3}\n")
    body = robot_body(description, urdf)
    limits = dict(zip(body.joints, body.gains.force_limit, strict=True))
    length = sum(little_hand.LENGTHS)
    assert limits["thumb_base_joint"] == pytest.approx(0.2)
    assert limits["index_base_joint"] == pytest.approx(0.3)
    assert limits["middle_base_joint"] == pytest.approx(15 * length, rel=1e-6)
    np.testing.assert_allclose(body.gains.stiffness, body.gains.force_limit / 0.2)


def test_what_an_arm_carries_is_cut_off_and_said(tmp_path):
    urdf, description = write(tmp_path, arm=True)
    found = hand_links(load_robot(description), urdf)
    assert found.links[0].name == "palm"
    assert "shoulder, wrist and 2 links above the palm are left out" in found.notes[0]
    alone = robot_body(description, urdf)
    assert len(alone.joints) == 8


def test_missing_and_impossible_inertias_are_mended(tmp_path):
    """A moving link needs a mass; moments of 1, 1 and 3 are no body's."""
    inertial = (
        '<inertial><mass value="0.1"/><inertia ixx="1e-5" iyy="1e-5" izz="3e-5" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    urdf, description = write(
        tmp_path, lambda text: text.replace('<link name="index_base">', f'<link name="index_base">{inertial}')
    )
    model = robot_body(description, urdf).spec().compile()
    box = np.array([0.012, 0.012, 0.03])
    wanted = 0.1 / 12 * ((box**2).sum() - box**2)
    np.testing.assert_allclose(sorted(model.body("index_base").inertia), sorted(wanted), rtol=1e-6)
    assert model.body("index_middle").mass[0] == pytest.approx(0.5 * 1000 * np.prod(box), rel=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda t: t.replace("</robot>", '<link name="second"/></robot>'),
            "has one root link, this has 'palm', 'second'",
        ),
        (
            lambda t: t.replace(
                "</robot>",
                '<joint name="loop" type="fixed"><parent link="index_tip"/><child link="thumb_tip"/></joint></robot>',
            ),
            "link 'thumb_tip' hangs on two joints, 'thumb_tip_joint' and 'loop'",
        ),
        (
            lambda t: re.sub(
                r'xyz="(\S+) (\S+) (\S+)"/><parent',
                lambda m: 'xyz="{} {} {}"/><parent'.format(*(100 * float(v) for v in m.groups())),
                t,
            ),
            r"m from the palm, of a hand 0.03 to 0.6 m \(is it in centimetres\?\)",
        ),
        (lambda t: t.replace('type="revolute"', 'type="fixed"'), "no movable joint moves"),
        (
            lambda t: t.replace("<box size='0.012 0.012 0.03'/>", '<mesh filename="absent.stl"/>', 1),
            "the mesh 'absent.stl' of link .* is not there",
        ),
        (lambda t: t.replace("0.012 0.012 0.03", "0.012 -0.012 0.03", 1), "has a shape of size"),
        (lambda t: re.sub("<collision>.*?</collision>", "", t), "no finger has a shape that could touch"),
        (lambda t: t.replace("index_tip", "other_tip"), "has no link 'index_tip'"),
    ],
)
def test_files_that_are_no_hand_are_refused_in_one_line(change, message, tmp_path):
    urdf, description = write(tmp_path, change)
    with pytest.raises(InputError, match=message) as caught:
        robot_body(description, urdf)
    assert "\n" not in str(caught.value)


def test_a_palm_that_does_not_carry_the_tips_is_refused(tmp_path):
    urdf, description = write(tmp_path)
    description.write_text(description.read_text().replace("palm: palm", "palm: index_middle"))
    with pytest.raises(InputError, match=r"palm 'index_middle' does not carry the finger tip 'thumb_tip'"):
        robot_body(description, urdf)


def test_a_second_hand_in_the_file_is_refused(tmp_path):
    def doubled(text):
        body = text[text.index('<link name="thumb_base">') : text.index("</robot>")]
        other = re.sub(r'"((?:thumb|index|middle|ring)_\w+)"', r'"left_\1"', body)
        return text.replace("</robot>", other + "</robot>")

    urdf, description = write(tmp_path, doubled)
    with pytest.raises(InputError, match="4 more fingers than the description names"):
        robot_body(description, urdf)


def test_a_capsule_is_measured_against_what_is_seen(tmp_path):
    """A box of 2 x 2 x 6 cm and its capsule of radius 1 cm: flush along the sides, off at the edges."""
    urdf, _ = write(tmp_path, lambda text: text.replace("0.012 0.012 0.03", "0.02 0.02 0.06"))
    link = read_urdf(urdf).links[0]
    (box,) = shapes_of(urdf, link.name, link.collisions)
    made = capsule(box)
    np.testing.assert_allclose(made.size, (0.01, 0.02), atol=1e-9)
    turned = Rotation.from_matrix(made.place[:3, :3]).apply([0, 0, 1])
    assert abs(turned[2]) == pytest.approx(1)
    assert off_the_mesh([box], [box]).max() < 2e-3  # between samples
    away = off_the_mesh([made], [box])
    assert 0.5e-3 < away.mean() < 3e-3


@pytest.mark.parametrize(("fineness", "fewer"), [(4, False), (5, True)])
def test_a_finely_rounded_hull_has_fewer_corners_and_nearly_the_same_shape(fineness, fewer):
    """Ellipsoids of 2,562 and 10,242 vertices: of the finer no vertex is 0.2 mm outside what is left."""
    ball = trimesh.creation.icosphere(fineness)
    vertices = ball.vertices * np.array([0.03, 0.02, 0.01])
    left = hull(Shape("mesh", (), np.eye(4), vertices, np.asarray(ball.faces)))
    assert (len(left.vertices) < len(vertices)) == fewer
    assert len(left.vertices) < 3000
    outside = -trimesh.Trimesh(left.vertices, left.faces).nearest.signed_distance(vertices[::7])
    assert outside.max() < 2e-4
    assert {tuple(row) for row in np.round(left.vertices, 9)} <= {tuple(row) for row in np.round(vertices, 9)}
