// One body as it is shown: its places, normals and shades, and the answer that they come from.

class View {
  constructor(painter, model) {
    const { nodes, triangles } = model, normals = new Float32Array(nodes.length);
    fillNormals(nodes, triangles, normals);
    Object.assign(this, { painter, model, surface: { nodes, triangles, normals } });
    this.places = Float32Array.from(nodes);
    this.normals = Float32Array.from(normals);
    this.shades = new Float32Array(nodes.length / 3);
    this.answer = { displacement: new Float32Array(nodes.length), forces: new Float32Array(0), error: NaN, doubt: "", ms: NaN };
    this.upload();
  }

  upload() {
    this.buffers = this.painter.surface(this.shades.length, this.surface.triangles);
    this.painter.send(this.buffers, { rest: this.surface.nodes, place: this.places, normal: this.normals });
    if (this.held) this.painter.send(this.buffers, { held: this.held });
  }

  // Take an answer to some presses; without any, the body is at rest.
  async ask(presses) {
    const began = performance.now();
    if (!presses.length) {
      this.answer.displacement.fill(0);
      this.answer = { ...this.answer, forces: new Float32Array(0), error: NaN, doubt: "", ms: NaN };
      return;
    }
    try {
      const found = await this.model.respond(presses);
      this.answer = { ...found, ms: found.ms ?? performance.now() - began };
      this.findHeld();
    } catch (error) {
      this.answer = { ...this.answer, error: NaN, doubt: error.message, ms: performance.now() - began };
    }
  }

  // What is held does not move at all, whatever is pressed; it is drawn dark.
  findHeld() {
    const { displacement } = this.answer;
    if (this.held) return;
    this.held = Float32Array.from(this.shades, (_, n) =>
      displacement[3 * n] || displacement[3 * n + 1] || displacement[3 * n + 2] ? 0 : 1);
    this.painter.send(this.buffers, { held: this.held });
  }

  // Bend the surface by `displacement`, and colour it by the length of each node's difference from `other`, as
  // `shade` makes a number from 0 to 1 of it. Returns the largest length [m].
  bend(displacement, other) {
    const { places, surface: { nodes, triangles }, normals } = this;
    for (let i = 0; i < places.length; i++) places[i] = nodes[i] + displacement[i];
    fillNormals(places, triangles, normals);
    return fillLengths(other ? this.answer.displacement : displacement, other, this.shades);
  }

  shade(ofLength) {
    for (let n = 0; n < this.shades.length; n++) this.shades[n] = ofLength(this.shades[n]);
    this.painter.send(this.buffers, { place: this.places, normal: this.normals, shade: this.shades });
  }
}

// What colours mean: the palette, the words below the bar, its marks, and the shade of a length.
const colouring = (kind, view, palettes, truth, most) => {
  const { peak_m: peak } = view.model.info, { error } = view.answer;
  if (kind === "error") {
    const bar = error * most; // the estimate, in metres
    return {
      palette: palettes.displacement, marks: [[0, "1"], [1 / 3, "10"], [2 / 3, "100"], [1, "1000"]],
      words: "displacement over the estimated error of this answer; grey: less than the error",
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
  const [full, step] = round(1e3 * peak);
  const marks = Array.from({ length: Math.round(full / step) + 1 }, (_, i) => [(i * step) / full, `${+(i * step).toPrecision(3)}`]);
  return { palette: palettes.displacement, marks, words: "displacement [mm]", ofLength: (length) => (1e3 * length) / full };
};

// A round number that is no less than `value`, and the step of its marks.
const round = (value) => {
  const power = 10 ** Math.floor(Math.log10(value));
  const [most, step] = [[1, 0.25], [2, 0.5], [4, 1], [5, 1], [8, 2], [10, 2.5]].find(([each]) => value <= each * power * 1.0001);
  return [most * power, step * power];
};
