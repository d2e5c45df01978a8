import numpy as np

from mjx_hand.rigid.segmentation.diffusion import diffused


def sheet(width: int, height: int, edge: float) -> tuple[np.ndarray, np.ndarray]:
    """A flat sheet of triangles of two very different sizes."""
    x = np.concatenate([np.arange(width // 2) * edge, (width // 2 + np.arange(width // 2) * 0.5) * edge])
    vertices = np.array([(a, b * edge, 0.0) for a in x for b in range(height)])
    corner = np.array([a * height + b for a in range(width - 1) for b in range(height - 1)])
    faces = [
        np.stack([corner, corner + height, corner + 1], 1),
        np.stack([corner + 1, corner + height, corner + height + 1], 1),
    ]
    return vertices, np.concatenate(faces)


def test_a_step_becomes_the_gaussians_integral_whatever_the_triangles():
    vertices, faces = sheet(80, 12, 1e-3)
    width, middle = 5e-3, 40e-3
    found = diffused((vertices[:, :1] > middle).astype(float), vertices, faces, width)[:, 0]
    # Implicit Euler is not quite the Gaussian, but has its spread: where the step has risen to 16 and 84 %.
    order = np.argsort(vertices[:, 0])
    low, centre, high = np.interp([0.16, 0.5, 0.84], found[order], vertices[order, 0])
    np.testing.assert_allclose(centre, middle, atol=0.5e-3)
    np.testing.assert_allclose((high - low) / 2, width, rtol=0.15)


def test_values_stay_within_their_range_and_constants_stay():
    rng = np.random.default_rng(0)
    vertices, faces = sheet(20, 20, 1e-3)
    vertices[:, :2] += rng.uniform(-4e-4, 4e-4, (len(vertices), 2))  # angles far above 90 degrees
    field = np.stack([rng.integers(0, 2, len(vertices)), np.full(len(vertices), 3.0)], axis=1)
    found = diffused(field, vertices, faces, 2e-3)
    assert found[:, 0].min() > -1e-12
    assert found[:, 0].max() < 1 + 1e-12
    np.testing.assert_allclose(found[:, 1], 3.0, rtol=1e-12)
    assert found[:, 0].std() < 0.4 * field[:, 0].std()
