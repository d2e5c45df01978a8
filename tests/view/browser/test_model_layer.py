"""Shapes that are no meshes, of a little hand of capsules and a box."""

import mujoco
import numpy as np

from mjx_hand.bodies.robot_body import robot_body
from mjx_hand.view.browser.model_layer import model_layer
from tests.robots.test_mjcf_file import write


def test_capsules_and_boxes_are_where_mujoco_has_them(tmp_path):
    model = robot_body(write(tmp_path)).spec(visual=True).compile()
    qpos = np.random.default_rng(0).uniform(0.1, 1.0, (2, model.nq))
    layer = model_layer(model, qpos, "little")
    seen = {int(model.geom_bodyid[k]): k for k in range(model.ngeom) if "_visual" in model.geom(k).name}
    assert len(layer.meshes) == len(seen) == 13
    data = mujoco.MjData(model)
    for row, places in zip(qpos, layer.transforms, strict=True):
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        for (body, geom), (vertices, faces), place in zip(sorted(seen.items()), layer.meshes, places, strict=True):
            assert faces.max() < len(vertices)
            world = vertices @ place[:3, :3].T + place[:3, 3]
            local = (world - data.geom_xpos[geom]) @ data.geom_xmat[geom].reshape(3, 3)
            size = model.geom_size[geom]
            if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX:
                np.testing.assert_allclose(np.abs(local), np.broadcast_to(size, local.shape), atol=1e-9)
                assert model.body(body).name == "palm"
                continue
            axis = np.clip(local[:, 2], -size[1], size[1])[:, None] * [0, 0, 1]
            np.testing.assert_allclose(np.linalg.norm(local - axis, axis=1), size[0], atol=1e-6)
            assert np.ptp(local[:, 2]) > 2 * size[1]
