"""Kinematic trees of human and robot hands against other programs' kinematics."""

import numpy as np
import pytest
import yourdfpy

from mjx_hand.capture.keypoints.layouts import hand_keypoints
from mjx_hand.errors import InputError
from mjx_hand.hand.load import load_hand
from mjx_hand.rigid.build import build_rigid_hand
from mjx_hand.rigid.rigid_hand import finger_tips, forward_kinematics
from mjx_hand.robots.human_tree import human_tree
from mjx_hand.robots.robot_hand import ROBOTS, known_robots, load_robot, robot_objective
from mjx_hand.robots.robot_urdf import robot_tree
from mjx_hand.robots.solver.kinematic_tree import joint_values, tree_points
from tests.robots.urdfs import FOLDERS, urdf_of


def test_the_human_tree_has_the_rigid_hands_keypoints():
    rigid = build_rigid_hand(load_hand())
    angles = np.random.default_rng(0).uniform(rigid.hinge_lower, rigid.hinge_upper, (7, 20)).astype(np.float32)
    _, positions = forward_kinematics(angles, rigid)
    expected = hand_keypoints(positions, finger_tips(angles, rigid))
    np.testing.assert_allclose(tree_points(angles, human_tree(rigid)), expected, atol=1e-6)


@pytest.mark.parametrize("robot", FOLDERS)
def test_links_stand_where_yourdfpy_and_pinocchio_have_them(robot):
    path = urdf_of(robot)
    model = yourdfpy.URDF.load(str(path), load_meshes=False, build_scene_graph=True)
    links = [link.name for link in model.robot.links]
    tree = robot_tree(path, links)
    rng = np.random.default_rng(1)
    dofs = rng.uniform(tree.lower, tree.upper).astype(np.float32)
    values = dict(zip(tree.joint_names, joint_values(dofs, tree), strict=True))
    points = np.asarray(tree_points(dofs, tree))
    model.update_cfg({name: values[name] for name in model.actuated_joint_names})
    expected = np.array([model.get_transform(link)[:3, 3] for link in links])
    np.testing.assert_allclose(points, expected, atol=1e-6)

    pinocchio = pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
    other = pinocchio.buildModelFromUrdf(str(path))
    data = other.createData()
    configuration = pinocchio.neutral(other)
    for name, value in values.items():
        # Pinocchio moves tied joints by itself where it knows of them, and then has no configuration of theirs.
        joint = other.joints[other.getJointId(name)]
        if joint.nq == 1:
            configuration[joint.idx_q] = value
    pinocchio.framesForwardKinematics(other, data, configuration)
    theirs = np.array([data.oMf[other.getFrameId(link)].translation for link in links])
    np.testing.assert_allclose(points, theirs, atol=1e-6)


HANDS = [(robot, side) for robot in known_robots() for side in ("right", "left") if "allegro" not in robot]


@pytest.mark.parametrize(("robot", "side"), [*HANDS, ("allegro", "right"), ("allegro_left", "left")])
def test_descriptions_fit_their_hands_and_palms_lie_as_they_say(robot, side):
    description = load_robot(robot)
    tree, _ = robot_objective(description, urdf_of(robot.split("_")[0], side))
    straight = tree_points(np.clip(np.zeros(tree.num_dofs, np.float32), tree.lower, tree.upper), tree)
    bent = tree_points(((tree.lower + tree.upper) / 2).astype(np.float32), tree)
    fingers = [tree.point_names.index(link) for link, k in description.tips.items() if not k.startswith("thumb")]
    reach = np.asarray(straight)[fingers] - np.asarray(straight)[0]
    assert (reach @ description.fingers > 0.8 * np.linalg.norm(reach, axis=1)).all()
    assert ((np.asarray(bent - straight))[fingers] @ description.palmar > 0.02).all()
    # The thumb's side: fingers × palmar points to it for a right hand, away from it for a left one.
    first, last = np.asarray(straight)[[fingers[0], fingers[-1]]]
    across = (first - last) @ np.cross(description.fingers, description.palmar)
    assert across > 0.02 if side == "right" else across < -0.02


def test_a_robot_hand_is_one_file(tmp_path):
    description = tmp_path / "mine.yaml"
    description.write_text((ROBOTS / "leap.yaml").read_text().replace("1.6", "1.4"))
    assert load_robot(description).scaling == 1.4
    assert load_robot(description).name == "mine"


URDF = """<robot name="r"><link name="base"/><link name="a"/><link name="b"/><link name="c"/>
<joint name="one" type="{one}"><parent link="base"/><child link="a"/>{axis}{limit}{mimic_one}</joint>
<joint name="two" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/>{mimic_two}</joint>
<joint name="three" type="fixed"><parent link="base"/><child link="c"/></joint></robot>"""
LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'


def written(tmp_path, one="revolute", axis='<axis xyz="0 0 1"/>', limit=LIMIT, mimic_one="", mimic_two=""):
    path = tmp_path / "robot.urdf"
    path.write_text(URDF.format(one=one, axis=axis, limit=limit, mimic_one=mimic_one, mimic_two=mimic_two))
    return path


def test_tied_joints_share_a_degree_of_freedom_and_its_limits(tmp_path):
    tree = robot_tree(written(tmp_path, mimic_two='<mimic joint="one" multiplier="-2" offset="0.5"/>'), ["b"])
    assert tree.dof_names == ("one",)
    np.testing.assert_allclose(joint_values(np.array([0.3]), tree), [0.3, -0.1], atol=1e-6)
    np.testing.assert_allclose((tree.lower, tree.upper), [[-0.25], [0.75]], atol=1e-6)  # -1 <= 0.5 - 2 x <= 1


@pytest.mark.parametrize(
    ("changes", "links", "message"),
    [
        ({}, ["d"], "has no link 'd'; its links: base, a, b, c"),
        ({}, ["c"], "no movable joint moves c"),
        ({"one": "floating"}, ["b"], "'one' is of type 'floating'; valid: fixed, revolute"),
        ({"one": "ball"}, ["b"], "'one' is of type 'ball'"),
        ({"limit": ""}, ["b"], "'one' has no limits"),
        (
            {"limit": '<limit lower="1" upper="-1"/>'},
            ["b"],
            "'one' has limits from 1.0 to -1.0; give the lower one first",
        ),
        ({"limit": '<limit lower="-1" upper="nan"/>'}, ["b"], "'one' has limits from -1.0 to nan"),
        ({"mimic_one": '<mimic joint="two"/>', "mimic_two": '<mimic joint="one"/>'}, ["b"], "in a circle: one -> two"),
        ({"mimic_two": '<mimic joint="four"/>'}, ["b"], "mimics 'four', which is no movable joint"),
        ({"mimic_two": '<mimic joint="one" offset="9"/>'}, ["b"], "exclude each other"),
        ({"limit": '<limit effort="1" velocity="1"/>'}, ["b"], "'one' has no limits"),
        ({"axis": '<axis xyz="1 0"/>'}, ["b"], r"'one' has axis \[1.0, 0.0\]; give a direction of three"),
        ({"axis": '<axis xyz="0 0 0"/>'}, ["b"], "give a direction of three"),
        ({"axis": '<axis xyz="1 x 0"/>'}, ["b"], "not a URDF that can be read"),
        ({"axis": '<origin xyz="1 0"/>'}, ["b"], "not a URDF that can be read|no place"),
        ({"axis": '<origin xyz="nan 0 0"/>'}, ["b"], "no place"),
        ({"mimic_two": '<mimic joint="one" multiplier="nan"/>'}, ["b"], "mimics by nan"),
        ({"one": "x" * 100000}, ["b"], "is of type 'xxx"),
        ({"mimic_two": f'<mimic joint="{"y" * 100000}"/>'}, ["b"], "mimics 'yyy"),
        ({}, ["z" * 100000], "has no link 'zzz"),
    ],
)
def test_urdfs_that_cannot_be_used_are_refused_in_one_line(tmp_path, changes, links, message):
    with pytest.raises(InputError, match=message) as caught:
        robot_tree(written(tmp_path, **changes), links)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value).replace(str(tmp_path), "")) < 400


def test_limits_that_leave_a_finger_one_position_do_not_count(tmp_path):
    """Joint two is at 1 + one, and may be at -1 to 1: one, which may be at 0 to 1, would stay at 0."""
    tied = '<mimic joint="one" offset="1"/>'
    tree = robot_tree(written(tmp_path, limit='<limit upper="1"/>', mimic_two=tied), ["b"])
    np.testing.assert_allclose((tree.lower, tree.upper), [[0.0], [1.0]])
    assert tree.overruled == ("two",)
    assert robot_tree(written(tmp_path, mimic_two='<mimic joint="one" offset="0.5"/>'), ["b"]).overruled == ()


@pytest.mark.parametrize(("limit", "ends"), [('lower="-0.5"', (-0.5, 0)), ('upper="0.5"', (0, 0.5))])
def test_a_limit_that_is_left_out_is_0(tmp_path, limit, ends):
    tree = robot_tree(written(tmp_path, limit=f"<limit {limit}/>"), ["a"])
    np.testing.assert_allclose((tree.lower[0], tree.upper[0]), ends)


@pytest.mark.parametrize("content", ["", "no xml", "<robot/>", "<mujoco/>", URDF[: len(URDF) // 2]])
def test_files_that_are_no_urdf_are_refused_in_one_line(tmp_path, content):
    path = tmp_path / "robot.urdf"
    path.write_text(content)
    with pytest.raises(InputError, match=r"not a URDF|no movable|has no link|no body has a hinge") as caught:
        robot_tree(path, ["a"])
    assert "\n" not in str(caught.value)


def test_a_missing_urdf_is_refused(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        robot_tree(tmp_path / "absent.urdf", ["a"])


GOOD = {
    "palm": "base",
    "tips": "{a: thumb_tip, b: index_tip}",
    "scaling": "1.5",
    "fingers": "[0, 0, 1]",
    "palmar": "[1, 0, 0]",
}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"palm": None}, "has no 'palm'"),
        ({"tips": "{a: thumb_tip}"}, "two links or more"),
        ({"tips": "{a: index_tip, b: thumb_tip}"}, "the thumb's first"),
        ({"tips": "{a: thumb_tip, b: sixth_tip}"}, "must give links their keypoints"),
        ({"scaling": "-1"}, "scaling is -1"),
        ({"fingers": "[0, 0]"}, "give a direction"),
        ({"palmar": "[0, 0, 1]"}, "at right angles"),
        ({"vectors": "some"}, "valid: tips, all"),
        ({"extra": "1"}, "'extra' is not known"),
        ({"palm": "[unclosed"}, "not YAML"),
    ],
)
def test_descriptions_that_cannot_be_used_are_refused_in_one_line(tmp_path, changes, message):
    content = {name: value for name, value in {**GOOD, **changes}.items() if value is not None}
    path = tmp_path / "mine.yaml"
    path.write_text("\n".join(f"{name}: {value}" for name, value in content.items()))
    with pytest.raises(InputError, match=message) as caught:
        load_robot(path)
    assert "\n" not in str(caught.value)


def test_an_unknown_robot_names_the_known_ones():
    with pytest.raises(InputError, match="valid: ability, allegro, allegro_left, inspire, leap, schunk, shadow"):
        load_robot("robonaut")
    with pytest.raises(InputError, match="valid: position, vector, dexpilot"):
        robot_objective(load_robot("inspire"), urdf_of("inspire"), "orientation")
