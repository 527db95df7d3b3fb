// One body as it is shown: its places, normals and colours, and the answer that they come from.

class View {
  // whole: a byte for each node of the whole body, 1 where it is held and cannot move
  constructor(painter, model, whole) {
    const { nodes, triangles } = model, held = model.cutHeld ?? whole, normals = new Float32Array(nodes.length);
    fillNormals(nodes, triangles, normals);
    Object.assign(this, { painter, model, held, surface: { nodes, triangles, normals }, ...inOrder(triangles, held) });
    this.places = Float32Array.from(nodes);
    this.normals = Float32Array.from(normals);
    this.shades = new Float32Array(nodes.length / 3);
    this.tints = new Uint8ClampedArray(4 * this.shades.length);
    this.depths = new WeakMap(); // of places, how deep they can be pressed
    this.apart = new Float32Array(3 * this.shades.length); // from each of three rings
    this.crossed = { triangles: new Uint32Array(triangles.length), count: 0 };
    this.answer = { displacement: new Float32Array(nodes.length), forces: new Float32Array(0), error: NaN, doubt: "", ms: NaN };
    this.upload();
  }

  upload() {
    this.buffers = this.painter.surface(this.surface.nodes, this.order, this.free);
    this.buffers.open = this.model.skin < this.shades.length;
  }

  // Take an answer to some presses; without any, the body is at rest.
  async ask(presses) {
    const began = performance.now();
    if (!presses.length) {
      this.answer.displacement.fill(0);
      this.answer = { ...this.answer, forces: new Float32Array(0), error: NaN, doubt: "", lost: false, ms: NaN, tip: null };
      return;
    }
    try {
      const found = presses[0].touch ? askTool(this.model, presses[0].touch) : await this.model.respond(presses);
      this.answer = { ...found, lost: false, ms: found.ms ?? performance.now() - began };
    } catch (error) {
      this.answer = { ...this.answer, tip: null, error: NaN, doubt: error.message, lost: true, ms: performance.now() - began };
    }
  }

  // Bend the surface by `displacement`; `shades` becomes the length of each node's difference from `other`, the largest
  // of which is returned [m].
  bend(displacement, other) {
    const { places, surface: { nodes, triangles }, normals } = this;
    for (let i = 0; i < places.length; i++) places[i] = nodes[i] + displacement[i];
    fillNormals(places, triangles, normals);
    return fillLengths(other ? this.answer.displacement : displacement, other, this.shades);
  }

  // Colour the surface: `ofLength` makes a shade of a length.
  shade({ ofLength, palette }, rows) {
    const skin = this.model.skin ?? this.shades.length;
    for (let n = 0; n < skin; n++) this.shades[n] = ofLength(this.shades[n]);
    this.shades.fill(OF_LIP, skin);
    fillTints(this.tints, this.shades, this.normals, palette, rows);
    this.painter.send(this.buffers, { place: this.places, tint: this.tints });
  }

  // Find the free triangles that rings cross, or come nearer to than a margin [m], as the body is at rest.
  cross(rings, count, margin) {
    const { order, crossed, apart, surface: { nodes } } = this, size = this.shades.length;
    for (let r = 0; r < count; r++) {
      const x = rings[4 * r], y = rings[4 * r + 1], z = rings[4 * r + 2], radius = rings[4 * r + 3];
      for (let n = 0, i = 0; n < size; n++, i += 3) {
        apart[r * size + n] = Math.sqrt((nodes[i] - x) ** 2 + (nodes[i + 1] - y) ** 2 + (nodes[i + 2] - z) ** 2) - radius;
      }
    }
    crossed.count = 0;
    for (let t = 0; t < this.free; t += 3) {
      for (let from = 0; from < count * size; from += size) {
        const a = apart[from + order[t]], b = apart[from + order[t + 1]], c = apart[from + order[t + 2]];
        if (Math.min(a, b, c) > margin || Math.max(a, b, c) < -margin) continue;
        crossed.triangles.set([order[t], order[t + 1], order[t + 2]], crossed.count);
        crossed.count += 3;
        break;
      }
    }
    return crossed;
  }
}

// Whether all corners of the triangle that begins at `t` are held.
const isHeld = (triangles, t, held) => held[triangles[t]] && held[triangles[t + 1]] && held[triangles[t + 2]];

// The corners of triangles, those that are held last, and how many of them are free.
const inOrder = (triangles, held) => {
  const free = [], last = [];
  for (let t = 0; t < triangles.length; t += 3) {
    (isHeld(triangles, t, held) ? last : free).push(triangles[t], triangles[t + 1], triangles[t + 2]);
  }
  return { order: Uint32Array.from([...free, ...last]), free: free.length };
};

// What colours mean: the palette, the words below the bar, its marks, and the shade of a length.
const colouring = (kind, view, palettes, truth, most) => {
  const { peak_m: peak } = view.model.info, { error } = view.answer;
  if (kind === "error") {
    const bar = error * most; // the estimate, in metres
    return {
      palette: palettes.displacement, marks: [[0, "1"], [1 / 3, "10"], [2 / 3, "100"], [1, "1000"]],
      words: `displacement over the estimated error of this answer; grey: ${bar > 0 ? "less than the error" : "none is estimated"}`,
      ofLength: bar > 0 ? (length) => (length > bar ? Math.log10(length / bar) / 3 : -1) : () => -1,
    };
  }
  if (kind === "truth" || kind === "between") {
    const against = kind === "truth" ? truth.peak : peak;
    const share = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1].find((each) => most <= each * against) ?? 2;
    const marks = [0, 0.5, 1].map((at) => [at, `${+(100 * share * at).toPrecision(2)}`]);
    const words = kind === "truth" ? "difference from the truth [% of its peak]"
      : "difference from the first answer [% of a full press]";
    return { palette: palettes.error, marks, words, ofLength: (length) => length / (share * against) };
  }
  // most places bear a fifth of the hardest press of all, which would be pale on an even scale
  const full = round(1e3 * peak), marks = [0, 0.05, 0.25, 0.5, 1].map((share) => [Math.sqrt(share), `${+(full * share).toPrecision(3)}`]);
  const words = "displacement [mm], on a root scale";
  return { palette: palettes.displacement, marks, words, ofLength: (length) => Math.sqrt((1e3 * length) / full) };
};

// A round number that is no less than `value`.
const round = (value) => {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * [1, 2, 4, 5, 8, 10].find((each) => value <= each * power * 1.0001);
};
