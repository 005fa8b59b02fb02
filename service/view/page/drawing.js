// SPDX-License-Identifier: Apache-2.0
// Colours and the little linear algebra that the page needs. Matrices are 4x4, column-major, as WebGL takes them; a
// pose is [x, y, z, qw, qx, qy, qz] of a body in the world, metres.

// Of objects and outcomes, in their order: the same as in the reports.
export const seriesColors = [[230, 120, 30], [45, 125, 200], [40, 160, 90], [200, 60, 110], [140, 95, 200],
  [190, 160, 20], [30, 170, 180], [120, 85, 65]];
export const seriesColor = (i) => seriesColors[i % seriesColors.length];
export const css = (rgb, alpha = 1) => `rgba(${rgb.map((c) => Math.round(c)).join(',')},${alpha})`;

// Of a share of the largest mass, as the heat maps of the reports have them.
const warmStops = [[255, 244, 176], [254, 217, 112], [253, 178, 62], [244, 128, 34], [220, 74, 24], [172, 28, 28],
  [108, 8, 32]];
export function warmColor(value) {
  const place = Math.min(1, Math.max(0, value)) * (warmStops.length - 1);
  const i = Math.min(Math.floor(place), warmStops.length - 2);
  return warmStops[i].map((c, k) => c + (place - i) * (warmStops[i + 1][k] - c));
}
export function warmOpacity(value) {
  const t = Math.min(1, Math.max(0, (value - 0.02) / 0.2));
  return 0.92 * t * t * (3 - 2 * t);
}

export const add = (a, b) => a.map((x, i) => x + b[i]);
export const sub = (a, b) => a.map((x, i) => x - b[i]);
export const scale = (a, s) => a.map((x) => x * s);
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const normalized = (a) => scale(a, 1 / (Math.hypot(...a) || 1));

export function multiply(a, b) {
  const m = new Float32Array(16);
  for (let c = 0; c < 4; ++c)
    for (let r = 0; r < 4; ++r)
      for (let k = 0; k < 4; ++k) m[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return m;
}

export function poseMatrix([x, y, z, qw, qx, qy, qz]) {
  return new Float32Array([
    1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy + qw * qz), 2 * (qx * qz - qw * qy), 0,
    2 * (qx * qy - qw * qz), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz + qw * qx), 0,
    2 * (qx * qz + qw * qy), 2 * (qy * qz - qw * qx), 1 - 2 * (qx * qx + qy * qy), 0, x, y, z, 1]);
}

// Of a rotation and a translation.
export function inverseRigid(m) {
  const t = [m[12], m[13], m[14]];
  const column = (i) => [m[4 * i], m[4 * i + 1], m[4 * i + 2]];
  const [x, y, z] = [column(0), column(1), column(2)];
  return new Float32Array([x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -dot(x, t), -dot(y, t),
    -dot(z, t), 1]);
}

export function transform(m, p) {
  const at = (r) => m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r];
  return [at(0), at(1), at(2), at(3)];
}

// The world to the camera's axes of a browser: x right, y up, looking along -z.
export function lookAt(eye, target, up) {
  const back = normalized(sub(eye, target));
  const right = normalized(cross(up, back));
  const above = cross(back, right);
  return inverseRigid(new Float32Array([...right, 0, ...above, 0, ...back, 0, ...eye, 1]));
}

export function perspective(fovY, aspect, near, far) {
  const f = 1 / Math.tan(fovY / 2);
  return new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0,
    2 * far * near / (near - far), 0]);
}

// A pinhole camera's, whose axes are x right, y down, z forward; the middle of the first pixel is at (0, 0).
export function pinhole({ width, height, fx, fy, cx, cy }, near = 0.02, far = 50) {
  return new Float32Array([2 * fx / width, 0, 0, 0, 0, -2 * fy / height, 0, 0, 2 * (cx + 0.5) / width - 1,
    1 - 2 * (cy + 0.5) / height, (far + near) / (far - near), 1, 0, 0, -2 * far * near / (far - near), 0]);
}
