"""The written URDF and MJCF: they load everywhere, mean the same body, and appear whole or not at all."""

import os
import xml.etree.ElementTree as ET

import mujoco
import numpy as np
import pytest
import trimesh
import yourdfpy
from mujoco import mjx

from mjx_hand.errors import InputError
from mjx_hand.hand.joints import FINGERS, HINGES, LINKS, WRIST_SLIDES, WRIST_TURNS
from mjx_hand.rigid.export import mesh_folder
from mjx_hand.rigid.export.mjcf import hand_spec, write_mjcf
from mjx_hand.rigid.export.urdf import write_urdf
from mjx_hand.rigid.gains import Gains

WRIST = [*WRIST_SLIDES, *WRIST_TURNS]


def names(model, kind, count):
    return [mujoco.mj_id2name(model, kind, k) for k in range(count)]


def mass_matrix(model, joints, angles):
    """Inertia over the named joints, without armature, which only the MJCF has."""
    data = mujoco.MjData(model)
    model.dof_armature[:] = 0
    data.qpos[[model.joint(name).qposadr[0] for name in joints]] = angles
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, full, data.qM) if hasattr(data, "qM") else mujoco.mj_fullM(model, data, full)
    order = [model.joint(name).dofadr[0] for name in joints]
    return full[np.ix_(order, order)]


@pytest.mark.parametrize("base", ["fixed", "actuated"])
def test_urdf_and_mjcf_have_the_same_dynamics(rigid, angles, tmp_path, base):
    urdf = mujoco.MjModel.from_xml_path(str(write_urdf(rigid, tmp_path, wrist_joints=base == "actuated")))
    mjcf = mujoco.MjModel.from_xml_path(str(write_mjcf(rigid, tmp_path, base=base)))
    joints = [*(WRIST if base == "actuated" else []), *HINGES]
    row = np.concatenate([np.full(len(joints) - 20, 0.1), angles[0]])
    a, b = mass_matrix(urdf, joints, row), mass_matrix(mjcf, joints, row)
    # The URDF's small links add a tenth of a gram.
    np.testing.assert_allclose(a, b, atol=5e-3 * np.abs(b).max())
    np.testing.assert_allclose(a[-20:, -20:], b[-20:, -20:], atol=1e-6)
    np.testing.assert_allclose(mjcf.body("wrist").subtreemass[0], rigid.link_mass.sum(), rtol=1e-5)


def test_mjcf_keeps_inertia_limits_and_gains(rigid, folder):
    model = mujoco.MjModel.from_xml_path(str(folder / f"{rigid.side}_hand.xml"))
    gains = Gains()
    for k, name in enumerate(HINGES):
        joint, actuator = model.joint(name), model.actuator(name)
        np.testing.assert_allclose(joint.range, [rigid.hinge_lower[k], rigid.hinge_upper[k]], atol=1e-5)
        np.testing.assert_allclose(joint.axis, rigid.hinge_axis[k], atol=1e-5)
        np.testing.assert_allclose(actuator.gainprm[0], gains.stiffness[k], rtol=1e-5)
        np.testing.assert_allclose(-actuator.biasprm[2], gains.damping[k], rtol=1e-4)
        np.testing.assert_allclose(actuator.forcerange, [-gains.force_limit[k], gains.force_limit[k]], rtol=1e-5)
        np.testing.assert_allclose(actuator.ctrlrange, joint.range, atol=1e-6)
    for k, name in enumerate(LINKS):
        body = model.body(name)
        np.testing.assert_allclose(body.mass, rigid.link_mass[k], rtol=1e-5)
        np.testing.assert_allclose(body.ipos, rigid.link_com[k], atol=1e-7)
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, body.iquat)
        rotation = rotation.reshape(3, 3)
        inertia = rotation @ np.diag(body.inertia) @ rotation.T
        np.testing.assert_allclose(inertia, rigid.link_inertia[k], atol=1e-4 * np.trace(rigid.link_inertia[k]))


def test_urdf_states_the_same_limits_and_is_well_formed(rigid, folder):
    robot = yourdfpy.URDF.load(str(folder / f"{rigid.side}_hand.urdf"))
    assert robot.validate()
    for k, name in enumerate(HINGES):
        limit = robot.joint_map[name].limit
        np.testing.assert_allclose([limit.lower, limit.upper], [rigid.hinge_lower[k], rigid.hinge_upper[k]], rtol=1e-6)
        assert limit.effort > 0
        assert limit.velocity > 0
    masses = []
    for link in robot.robot.links:
        inertial = link.inertial
        assert inertial is not None
        assert inertial.mass is not None
        assert inertial.inertia is not None
        assert inertial.mass > 0
        masses.append(inertial.mass)
        moments = np.linalg.eigvalsh(inertial.inertia)
        assert moments[0] > 0
        assert moments[2] <= moments[0] + moments[1] + 1e-15
    np.testing.assert_allclose(sum(masses), rigid.link_mass.sum(), rtol=1e-3)


def test_written_meshes_are_watertight_and_relative(rigid, folder):
    urdf = ET.parse(folder / f"{rigid.side}_hand.urdf").getroot()
    paths = [mesh.get("filename") for mesh in urdf.iter("mesh")]
    assert paths == [f"meshes/{name}.obj" for name in LINKS]
    for path in paths:
        assert trimesh.load_mesh(folder / path, process=False).is_watertight
    text = (folder / f"{rigid.side}_hand.xml").read_text()
    assert str(folder) not in text
    assert "vertex=" not in text


@pytest.fixture(scope="module")
def with_hulls(rigid, tmp_path_factory):
    folder = tmp_path_factory.mktemp("hulls")
    write_urdf(rigid, folder, collision="hulls")
    write_mjcf(rigid, folder, collision="hulls")
    return folder


def test_hulls_are_convex_closed_and_around_their_links(rigid, with_hulls):
    urdf = ET.parse(with_hulls / f"{rigid.side}_hand.urdf").getroot()
    paths = [mesh.get("filename") for collision in urdf.iter("collision") for mesh in collision.iter("mesh")]
    assert paths == [f"meshes/{name}_hull.obj" for name in LINKS]
    assert not list(urdf.iter("cylinder"))
    for path, vertices in zip(paths, rigid.mesh_vertices, strict=True):
        hull = trimesh.load_mesh(with_hulls / path, process=False)
        assert hull.is_watertight
        assert hull.volume > 0
        # Convex, and around its link: nothing lies beyond a face (the file has tenths of a micrometre).
        everything = np.concatenate([vertices, hull.vertices])
        wide = hull.area_faces > 1e-8  # a sliver's direction is all rounding
        beyond = np.einsum("fi,fvi->fv", hull.face_normals[wide], everything - hull.triangles[wide, :1])
        assert beyond.max() < 2e-6


def test_hulls_collide_in_engines(rigid, with_hulls):
    for suffix in ("urdf", "xml"):
        model = mujoco.MjModel.from_xml_path(str(with_hulls / f"{rigid.side}_hand.{suffix}"))
        colliding = (model.geom_contype > 0) | (model.geom_conaffinity > 0)
        assert set(model.geom_type[colliding].tolist()) == {int(mujoco.mjtGeom.mjGEOM_MESH)}
        np.testing.assert_allclose(model.body_mass[model.body("wrist").id], rigid.link_mass[0], rtol=1e-5)
    # A ball pressed onto the palm rests on it, as on the skin: not on the capsules, which are not there.
    spec = hand_spec(rigid, collision="hulls", visual=False)
    assert {geom.name for geom in spec.geoms} == {f"{name}_hull" for name in LINKS}
    middle = np.asarray(rigid.mesh_vertices[0]).mean(axis=0)
    top = np.asarray(rigid.mesh_vertices[0])[:, 1].max()
    ball = spec.worldbody.add_body(name="ball", pos=[middle[0], top + 0.05, middle[2]])
    ball.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 1, 0])
    ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.02, 0, 0], mass=0.05)
    spec.option.gravity = [0, -9.81, 0]
    model = spec.compile()
    data = mujoco.MjData(model)
    for _ in range(800):
        mujoco.mj_step(model, data)
    assert data.ncon > 0
    assert top - 0.02 < data.body("ball").xpos[1] - 0.02 < top + 0.001


@pytest.mark.parametrize("write", [write_urdf, write_mjcf])
def test_unknown_collision_shape_is_refused(right, tmp_path, write):
    with pytest.raises(InputError, match="collision is 'mesh'; valid: capsules, hulls"):
        write(right, tmp_path / "out", collision="mesh")
    assert not list(tmp_path.iterdir())


def test_descriptions_survive_a_move(rigid, folder, tmp_path):
    moved = tmp_path / "elsewhere"
    folder.rename(moved)
    try:
        mujoco.MjModel.from_xml_path(str(moved / f"{rigid.side}_hand.xml"))
        assert yourdfpy.URDF.load(str(moved / f"{rigid.side}_hand.urdf")).scene.geometry
    finally:
        moved.rename(folder)


@pytest.mark.parametrize(("base", "first"), [("fixed", []), ("free", ["wrist"]), ("actuated", WRIST)])
def test_bases_and_prefix(right, base, first):
    model = hand_spec(right, base=base, prefix="r_", visual=False).compile()
    joints = names(model, mujoco.mjtObj.mjOBJ_JOINT, model.njnt)
    assert joints == [f"r_{name}" for name in (*first, *HINGES)]
    actuators = names(model, mujoco.mjtObj.mjOBJ_ACTUATOR, model.nu)
    assert actuators == [f"r_{name}" for name in (*(WRIST if base == "actuated" else []), *HINGES)]
    assert names(model, mujoco.mjtObj.mjOBJ_SENSOR, model.nsensor) == [f"r_{finger}_tip" for finger in FINGERS]
    assert model.nmesh == 0


def test_two_hands_attach_to_one_scene(left, right):
    scene = mujoco.MjSpec()
    for hand, y in ((left, -0.3), (right, 0.3)):
        frame = scene.worldbody.add_frame(pos=[0, y, 0])
        scene.attach(hand_spec(hand, base="actuated", prefix=f"{hand.side}_"), frame=frame)
    model = scene.compile()
    assert model.nu == 52
    assert model.nmesh == 32


def test_mjx_takes_the_model(right):
    model = hand_spec(right, base="actuated", visual=False).compile()
    assert mjx.put_model(model).nv == 26


def test_the_hand_holds_a_posture_and_does_not_touch_itself(right):
    model = hand_spec(right, base="actuated", visual=False).compile()
    model.opt.timestep, model.opt.integrator = 0.004, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    data = mujoco.MjData(model)
    flexed = np.where([name.endswith("flexion") for name in HINGES], 0.6, 0.0)
    data.ctrl[6:] = flexed
    for _ in range(250):
        mujoco.mj_step(model, data)
        assert data.ncon == 0
    np.testing.assert_allclose(data.qpos[6:], flexed, atol=0.1)
    assert np.abs(data.qvel[6:]).max() < 0.05


def test_unknown_base_is_refused(right):
    with pytest.raises(InputError, match="fixed, free, actuated"):
        hand_spec(right, base="floating")


def test_other_files_in_the_folder_stay(right, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    write_urdf(right, tmp_path)
    write_urdf(right, tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["meshes", "notes.txt", "right_hand.urdf"]


@pytest.mark.parametrize("write", [write_urdf, write_mjcf])
def test_a_failed_write_leaves_nothing(right, tmp_path, monkeypatch, write):
    def broken(rigid, folder, collision):
        (folder / "half").write_text("")
        raise OSError(28, "No space left on device")

    module = __import__(write.__module__, fromlist=["write_meshes"])
    monkeypatch.setattr(module, "write_meshes", broken)
    with pytest.raises(InputError, match="No space left"):
        write(right, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("write", [write_urdf, write_mjcf])
def test_an_unwritable_folder_is_named(right, tmp_path, write):
    file = tmp_path / "taken"
    file.write_text("")
    with pytest.raises(InputError, match="taken"):
        write(right, file)
    with pytest.raises(InputError, match="taken"):
        write(right, file / "below")


def test_new_folders_have_ordinary_permissions(right, tmp_path):
    path = write_urdf(right, tmp_path / "out")
    umask = os.umask(0)
    os.umask(umask)
    assert path.parent.stat().st_mode & 0o777 == 0o777 & ~umask
    assert mesh_folder.MESHES in {entry.name for entry in path.parent.iterdir()}
