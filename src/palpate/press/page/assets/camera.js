// Vectors of three numbers, and the camera: orthographic, turned about the body's upright axis.
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const sum = (a, b, times = 1) => [a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2]];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => { const length = norm(a) || 1; return [a[0] / length, a[1] / length, a[2] / length]; };
const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

// Yaw and pitch from which a body is seen at first: a little aside and above, else from behind, or from below.
const FIRST_VIEWS = [[-0.35, 0.75], [Math.PI - 0.35, 0.75], [-0.35, -0.75], [Math.PI - 0.35, -0.75]];

class Camera {
  // nodes: Float32Array (3 n) [m] of the body at rest; held: a byte for each, 1 where it is held
  constructor(nodes, held = []) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < nodes.length; i++) {
      low[i % 3] = Math.min(low[i % 3], nodes[i]);
      high[i % 3] = Math.max(high[i % 3], nodes[i]);
    }
    this.centre = sum(low, high).map((value) => value / 2);
    const size = sum(high, low, -1);
    // the longest side lies across, and the shortest points at the viewer; seen from a little aside and above
    const order = [0, 1, 2].sort((a, b) => size[b] - size[a]);
    const right = [0, 0, 0], toward = [0, 0, 0];
    right[order[0]] = 1;
    toward[order[2]] = 1;
    this.axes = [right, cross(toward, right), toward];
    this.reach = norm(size);
    this.extent = Math.max(...size);
    let count = 0;
    this.back = [0, 0, 0]; // from the middle to what is held
    for (let i = 0; i < held.length; i++) {
      if (!held[i]) continue;
      this.back = sum(this.back, sum([nodes[3 * i], nodes[3 * i + 1], nodes[3 * i + 2]], this.centre, -1));
      count += 1;
    }
    this.back = this.back.map((value) => value / (count || 1));
    this.reset();
    this.frame(nodes);
  }

  // how far the body reaches across and upward as it is seen at first, and what lies in the middle then
  frame(nodes) {
    const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
    for (let i = 0; i < nodes.length; i += 3) {
      const from = sum([nodes[i], nodes[i + 1], nodes[i + 2]], this.centre, -1);
      for (const k of [0, 1]) {
        const at = dot(this.rows[k], from);
        low[k] = Math.min(low[k], at);
        high[k] = Math.max(high[k], at);
      }
    }
    this.spans = [0, 1].map((k) => high[k] - low[k]);
    for (const k of [0, 1]) this.centre = sum(this.centre, this.rows[k], (low[k] + high[k]) / 2);
  }

  reset() {
    this.zoom = 1;
    const nearest = FIRST_VIEWS.map(([yaw, pitch]) => {
      [this.yaw, this.pitch] = [yaw, pitch];
      this.refresh();
      return dot(this.rows[2], this.back);
    });
    // what is held is not in front, where it would be pressed in vain
    const chosen = nearest.findIndex((near) => near <= 0.2 * norm(this.back));
    [this.yaw, this.pitch] = FIRST_VIEWS[chosen < 0 ? nearest.indexOf(Math.min(...nearest)) : chosen];
    this.refresh();
  }

  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = clamp(this.pitch + pitch, -1.57, 1.57);
    this.refresh();
  }

  magnify(factor) {
    this.zoom = clamp(this.zoom * factor, 0.5, 8);
  }

  // the rows of `rows`: what lies to the right, up, and toward the viewer
  refresh() {
    const [c, s, d, t] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    const mix = [[c, 0, s], [t * s, d, -t * c], [-d * s, t, d * c]];
    this.rows = mix.map((row) => [0, 1, 2].map((k) => row.reduce((all, share, j) => all + share * this.axes[j][k], 0)));
  }

  // the size [m] of a pixel of a view of some pixels
  pixel(width, height) {
    return Math.max((1.16 * this.spans[0]) / width, (1.2 * this.spans[1]) / height) / this.zoom;
  }

  // what the shader multiplies turned places by, to have them in the cube of clip space
  scale(width, height) {
    const pixel = this.pixel(width, height);
    return [2 / (pixel * width), 2 / (pixel * height), 1 / (2 * this.reach)];
  }

  // a place [m] as pixels from the top left of a view
  project(place, width, height) {
    const pixel = this.pixel(width, height), from = sum(place, this.centre, -1);
    return [width / 2 + dot(this.rows[0], from) / pixel, height / 2 - dot(this.rows[1], from) / pixel];
  }

  // the triangle nearest to the viewer under a pixel, and the weights of its corners; null beside the body
  pick(places, triangles, x, y, width, height) {
    const pixel = this.pixel(width, height), [right, up, toward] = this.rows;
    const [px, py] = [(x - width / 2) * pixel, (height / 2 - y) * pixel];
    const flat = (this.flat ??= []), count = places.length / 3;
    if (flat.length !== 3 * count) this.flat = new Float32Array(3 * count);
    const seen = this.flat, [cx, cy, cz] = this.centre;
    for (let i = 0; i < 3 * count; i += 3) {
      const [a, b, c] = [places[i] - cx, places[i + 1] - cy, places[i + 2] - cz];
      seen[i] = right[0] * a + right[1] * b + right[2] * c - px;
      seen[i + 1] = up[0] * a + up[1] * b + up[2] * c - py;
      seen[i + 2] = toward[0] * a + toward[1] * b + toward[2] * c;
    }
    let best = null, nearest = -Infinity;
    for (let t = 0; t < triangles.length; t += 3) {
      const [i, j, k] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
      const u = seen[j] * seen[k + 1] - seen[k] * seen[j + 1];
      const v = seen[k] * seen[i + 1] - seen[i] * seen[k + 1];
      const w = seen[i] * seen[j + 1] - seen[j] * seen[i + 1];
      if (u < 0 || v < 0 || w < 0) continue; // outside, or seen from behind
      const all = u + v + w;
      if (all <= 0) continue;
      const near = (u * seen[i + 2] + v * seen[j + 2] + w * seen[k + 2]) / all;
      if (near > nearest) [nearest, best] = [near, { triangle: t / 3, weights: [u / all, v / all, w / all] }];
    }
    return best;
  }
}
