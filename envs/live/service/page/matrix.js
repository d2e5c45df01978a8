// 4 x 4 matrices, column by column, as WebGL and WebXR have them.

export function multiply(a, b) {
  const out = new Float32Array(16);
  for (let column = 0; column < 4; column++)
    for (let row = 0; row < 4; row++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += a[4 * k + row] * b[4 * column + k];
      out[4 * column + row] = sum;
    }
  return out;
}

// Of a position and a quaternion (w, x, y, z) that begin at `at`.
export function placed(values, at = 0) {
  const [px, py, pz, w, x, y, z] = values.slice(at, at + 7);
  return new Float32Array([
    1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), 0,
    2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x), 0,
    2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y), 0,
    px, py, pz, 1,
  ]);
}

export function perspective(vertical, aspect, near, far) {
  const f = 1 / Math.tan(vertical / 2);
  return new Float32Array([
    f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0,
  ]);
}

// The view from an eye to a centre, z up.
export function looking(eye, centre) {
  const back = unit(eye.map((v, k) => v - centre[k]));
  const right = unit([-back[1], back[0], 0]);
  const up = [
    back[1] * right[2] - back[2] * right[1],
    back[2] * right[0] - back[0] * right[2],
    back[0] * right[1] - back[1] * right[0],
  ];
  const off = (axis) => -(axis[0] * eye[0] + axis[1] * eye[1] + axis[2] * eye[2]);
  return new Float32Array([
    right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0, off(right), off(up), off(back), 1,
  ]);
}

// Of a rigid transform.
export function inverse(m) {
  const off = (k) => -(m[4 * k] * m[12] + m[4 * k + 1] * m[13] + m[4 * k + 2] * m[14]);
  return new Float32Array([
    m[0], m[4], m[8], 0, m[1], m[5], m[9], 0, m[2], m[6], m[10], 0, off(0), off(1), off(2), 1,
  ]);
}

function unit(v) {
  const length = Math.hypot(...v) || 1;
  return v.map((each) => each / length);
}
