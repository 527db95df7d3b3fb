// Linear elements on the coarse mesh, with small strains: palpate/press/coarse_rival.py in JavaScript.
class Coarse {
  constructor(buffer, more) {
    const bytes = new Uint8Array(buffer), end = bytes.indexOf(10);
    this.info = { ...JSON.parse(new TextDecoder().decode(bytes.subarray(0, end))), ...more };
    let start = end + 1;
    const take = (Kind, name) => {
      const count = this.info.shapes[name].reduce((all, size) => all * size, 1), from = start;
      start += 4 * count;
      return new Kind(buffer, from, count);
    };
    this.nodes = take(Float32Array, "nodes");
    this.triangles = take(Uint32Array, "triangles");
    this.parents = take(Uint32Array, "parents");
    this.weights = take(Float32Array, "weights");
    this.compliance = take(Float32Array, "compliance");
    this.count = this.info.shapes.compliance[0] / 3;
    this.normals = new Float32Array(this.nodes.length);
    const areas = new Float32Array(this.nodes.length);
    fillNormals(this.nodes, this.triangles, this.normals, areas);
    this.areas = areas;
  }

  // what of a force on the disc around a place each free coarse node bears: numbers and shares
  shares({ triangle, weights }) {
    const corners = [0, 1, 2].map((c) => this.triangles[3 * triangle + c]);
    const mix = (values) => [0, 1, 2].map((k) => corners.reduce((all, node, c) => all + weights[c] * values[3 * node + k], 0));
    const place = mix(this.nodes), normal = mix(this.areas), fine = new Float64Array(this.nodes.length / 3);
    let total = 0;
    for (let n = 0; n < fine.length; n++) {
      const [x, y, z] = [0, 1, 2].map((k) => this.nodes[3 * n + k] - place[k]);
      const near = 1 - (x * x + y * y + z * z) / this.info.radius_m ** 2;
      const area = [...this.areas.subarray(3 * n, 3 * n + 3)];
      if (near > 0 && dot(area, normal) > 0) total += fine[n] = near * norm(area);
    }
    if (!total) corners.forEach((node, c) => (total += fine[node] = weights[c]));
    const coarse = new Float64Array(this.count);
    for (let i = 0; i < this.parents.length; i++) coarse[this.parents[i]] += (this.weights[i] * fine[Math.floor(i / 3)]) / total;
    return coarse;
  }

  // how coarse nodes move by unit forces along x, y and z on a disc, (3 m) each
  columns(shares) {
    const size = 3 * this.count, found = [0, 1, 2].map(() => new Float64Array(size));
    shares.forEach((share, j) => {
      if (!share) return;
      // the compliance is symmetric, so its rows are its columns
      for (let b = 0; b < 3; b++) {
        const row = (3 * j + b) * size;
        for (let i = 0; i < size; i++) found[b][i] += share * this.compliance[row + i];
      }
    });
    return found;
  }

  respond(presses) {
    const began = performance.now(), shares = presses.map((press) => this.shares(press));
    const columns = shares.map((share) => this.columns(share)), size = 3 * presses.length;
    const between = Array.from({ length: size }, (_, i) => Array.from({ length: size }, (_, k) => {
      const share = shares[Math.floor(i / 3)], moved = columns[Math.floor(k / 3)][k % 3];
      return share.reduce((all, s, m) => all + s * moved[3 * m + (i % 3)], 0);
    }));
    const forces = presses.flatMap(({ force }) => [...(force ?? [0, 0, 0])]);
    const pushed = forces.map((_, i) => i).filter((i) => presses[Math.floor(i / 3)].moved);
    const missing = pushed.map((i) => presses[Math.floor(i / 3)].moved[i % 3] - forces.reduce((all, f, k) => all + between[i][k] * f, 0));
    const found = solved(pushed.map((i) => pushed.map((k) => between[i][k])), missing);
    pushed.forEach((i, at) => (forces[i] = found[at]));
    const coarse = new Float64Array(3 * this.count);
    forces.forEach((f, k) => columns[Math.floor(k / 3)][k % 3].forEach((moved, i) => (coarse[i] += f * moved)));
    const displacement = new Float32Array(this.nodes.length);
    for (let i = 0; i < this.parents.length; i++) {
      const node = 3 * Math.floor(i / 3), from = 3 * this.parents[i], weight = this.weights[i];
      for (let k = 0; k < 3; k++) displacement[node + k] += weight * coarse[from + k];
    }
    return { displacement, forces: Float32Array.from(forces), error: NaN, doubt: "", ms: performance.now() - began };
  }
}

// The solution of a small dense system, by elimination with pivots.
const solved = (matrix, right) => {
  const rows = matrix.map((row, i) => [...row, right[i]]), size = right.length;
  for (let k = 0; k < size; k++) {
    const best = rows.reduce((top, row, i) => (i >= k && Math.abs(row[k]) > Math.abs(rows[top][k]) ? i : top), k);
    [rows[k], rows[best]] = [rows[best], rows[k]];
    for (let i = k + 1; i < size; i++) {
      const times = rows[i][k] / rows[k][k];
      for (let j = k; j <= size; j++) rows[i][j] -= times * rows[k][j];
    }
  }
  const found = new Array(size).fill(0);
  for (let k = size - 1; k >= 0; k--) {
    found[k] = (rows[k][size] - found.reduce((all, x, j) => (j > k ? all + rows[k][j] * x : all), 0)) / rows[k][k];
  }
  return found;
};
