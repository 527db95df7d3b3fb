// A rigid instrument: pressed at places that a model was prepared at, with a curve of its force against the depth.
const CURVE = 12, WIDE = 220, HIGH = 96, LATHE = 28; // points of the curve, its size in pixels, and sides of the instrument

class Tool extends Finger {
  // touch: of model.touches[number]
  constructor(surface, number, touch, depth) {
    super(surface, Tool.at(surface, touch), depth);
    Object.assign(this, { number, touch });
  }

  static at({ triangles }, { node }) {
    const i = triangles.indexOf(node);
    return { triangle: Math.floor(i / 3), weights: [0, 1, 2].map((c) => Number(c === i % 3)) };
  }

  get frame() {
    const { axes } = this.touch;
    return [[...axes.subarray(6)], [...axes.subarray(0, 3)], [...axes.subarray(3, 6)]];
  }

  get press() {
    return { touch: { place: this.number, depth: this.shown, direction: this.direction } };
  }
}

// Ask a model for an instrument; what is shown as its force is what the hand feels, along its way.
const askTool = (model, touch) => {
  if (!model.touches?.length) throw new Error("this model knows no rigid instrument");
  const found = model.touch(touch);
  return { ...found, forces: Float32Array.from(touch.direction, (x) => x * found.forceAlong) };
};

// The triangles of an instrument that stands on its tip, turned around its axis: local places (3 n) and their corners.
const lathed = ({ kind, radius, edge }) => {
  const arc = Array.from({ length: 13 }, (_, i) => (i / 12) * (kind === "sphere" ? Math.PI : Math.PI / 2));
  const rim = arc.map((a) => [radius - edge + edge * Math.sin(a), edge * (1 - Math.cos(a))]);
  const profile = kind === "sphere" ? rim : [[0, 0], ...rim, [radius, 4 * radius], [0, 4 * radius]];
  const places = profile.flatMap(([rho, z]) => Array.from({ length: LATHE }, (_, i) => {
    const turn = (2 * Math.PI * i) / LATHE;
    return [rho * Math.cos(turn), rho * Math.sin(turn), z];
  }).flat());
  const corners = [];
  for (let j = 0; j + 1 < profile.length; j++) for (let i = 0; i < LATHE; i++) {
    const [a, b] = [j * LATHE + i, j * LATHE + ((i + 1) % LATHE)];
    corners.push(a, a + LATHE, b, b, a + LATHE, b + LATHE);
  }
  return { places, corners: Uint32Array.from(corners) };
};

Object.assign(Stage.prototype, {
  // the kinds of instruments that the model was prepared for, by their names
  tools() {
    const found = {};
    (this.main?.model.touches ?? []).forEach((each, number) => {
      const name = `${each.kind === "sphere" ? "Ball" : "Punch"} ${+(1e3 * each.radius).toPrecision(3)} mm`;
      (found[name] ??= []).push([each, number]);
    });
    return found;
  },

  useTool(name) {
    this.changed();
    [this.tool, this.fingers, this.active] = [this.tools()[name] ? name : null, [], null];
    this.panel.choose();
    this.refresh();
  },

  // press with the instrument at the prepared place that is nearest
  putTool(place) {
    const point = new Finger(this.main.surface, place, 0).rest, { nodes } = this.main.surface;
    const away = ([{ node }]) => Math.hypot(...[0, 1, 2].map((d) => nodes[3 * node + d] - point[d]));
    const [touch, number] = this.tools()[this.tool].reduce((best, each) => (away(each) < away(best) ? each : best));
    if (this.active?.number !== number) this.active = new Tool(this.main.surface, number, touch, this.depth);
    this.active.depth = Math.min(this.active.wish, touch.deepest);
    this.active.leaving = false;
    this.fingers = [this.active];
    this.changed();
    return this.active;
  },

  // the instrument as it stands now, half transparent
  drawTool() {
    const { active, main, painter } = this, tip = main.answer.tip;
    if (!active?.touch || !tip) return;
    if (this.rigid?.touch !== active.touch) {
      const made = lathed(active.touch), count = made.places.length;
      const ends = { at: new Float32Array(count), normals: new Float32Array(count), tints: new Uint8ClampedArray((4 * count) / 3) };
      this.rigid = { touch: active.touch, ...made, ...ends, buffers: painter.surface(Float32Array.from(made.places), made.corners, made.corners.length) };
    }
    const { places, corners, at, normals, tints, buffers } = this.rigid, { axes } = active.touch, { gl } = painter;
    for (let i = 0; i < at.length; i++) {
      const n = i - (i % 3), d = i % 3;
      at[i] = tip[d] + places[n] * axes[d] + places[n + 1] * axes[3 + d] + places[n + 2] * axes[6 + d];
    }
    fillNormals(at, corners, normals);
    fillTints(tints, new Float32Array(at.length / 3).fill(-1), normals, this.palettes.displacement, this.camera.rows);
    painter.send(buffers, { place: at, tint: tints });
    const [left, top, width, height] = this.box(0, gl.canvas.width, gl.canvas.height);
    gl.viewport(left, gl.canvas.height - top - height, width, height);
    gl.bindVertexArray(buffers.array);
    gl.enable(gl.BLEND);
    gl.blendColor(0, 0, 0, 0.6);
    gl.blendFunc(gl.CONSTANT_ALPHA, gl.ONE_MINUS_CONSTANT_ALPHA);
    painter.pass(painter.plain, this.camera, [left, top, width, height], buffers.order, 0, corners.length);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.disable(gl.BLEND);
  },
});

Object.assign(Panel.prototype, {
  // the finger and the instruments, and below them the curve of an instrument that presses
  tools() {
    this.toolChoice = make("fieldset", { className: "ways tools", hidden: true });
    this.curve = make("div", { className: "curve", hidden: true });
    this.curve.setAttribute("role", "img");
    return make("div", {}, this.toolChoice, this.curve);
  },

  offerTools() {
    const names = ["Finger", ...Object.keys(this.stage.tools())], chosen = this.stage.tool ?? "Finger";
    this.toolChoice.hidden = names.length < 2;
    if (this.toolChoice.dataset.names !== names.join()) {
      this.toolChoice.dataset.names = names.join();
      this.toolChoice.replaceChildren(make("legend", { textContent: "Press with" }), ...names.map((name) => {
        const radio = make("input", { type: "radio", name: `${this.stage.figure.id}_tool`, value: name });
        radio.addEventListener("change", () => this.stage.useTool(name));
        return make("label", {}, radio, make("span", { textContent: name }));
      }));
    }
    this.toolChoice.querySelectorAll("input").forEach((radio) => (radio.checked = radio.value === chosen));
  },

  // force against depth as the instrument goes in this direction, with its error, and where it is
  drawCurve() {
    const { active, main } = this.stage;
    this.curve.hidden = !active?.touch || !main.answer.tip;
    if (this.curve.hidden) return;
    const { touch, number, direction } = active, key = [number, ...direction].join();
    if (this.curveKey !== key) {
      const depths = Array.from({ length: CURVE + 1 }, (_, i) => (i / CURVE) * touch.deepest);
      this.curvePoints = depths.map((depth) => [depth, main.model.touch({ place: number, depth, direction })]);
      this.curveKey = key;
    }
    const points = this.curvePoints, most = 1.1 * Math.max(...points.map(([, each]) => each.forceAlong * (1 + each.forceError)), 1e-9);
    const x = (depth) => 8 + (WIDE - 16) * (depth / (1.2 * touch.deepest)), y = (force) => HIGH - 6 - (HIGH - 12) * (force / most);
    const path = (times) => points.map(([depth, each]) => `${x(depth).toFixed(1)},${y(each.forceAlong * (1 + times * each.forceError)).toFixed(1)}`);
    const { forceAlong, forceError } = main.answer, said3 = (newtons) => said(1e3 * newtons, "mN");
    this.curve.innerHTML = `<svg viewBox="0 0 ${WIDE} ${HIGH}"><polygon class="band" points="${[...path(1), ...path(-1).reverse()].join(" ")}"/>` +
      `<path class="axes" d="M8 4V${HIGH - 6}H${WIDE - 8}"/><polyline points="${path(0).join(" ")}"/>` +
      `<circle cx="${x(active.shown)}" cy="${Math.max(y(forceAlong), 3)}" r="4"/></svg>`;
    const words = `force along the way against depth, to ${said(1e3 * touch.deepest, "mm")}; now ${said3(forceAlong)} ± ${percent(forceError)}`;
    this.curve.setAttribute("aria-label", words);
    this.curve.append(make("span", { textContent: words }));
  },
});
