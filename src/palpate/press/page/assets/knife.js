// A knife: a drag over the skin is a cut of the body at rest, which models on a server may follow; and a grip that pulls.
const PATH_POINTS = 12, STRAY = 0.006, BEYOND = 0.06; // of a path; what it may stray, and goes on outside, over the body
const PULL_MOST = 2; // as far as a grip pulls, over the largest displacement of a press
const RIM = [0.55, 0.1, 0.08]; // the colour of a cut's rim
const BLADE = [0.01, 0.1, 0.2]; // depths of the knife, over the body's size: least, at first, and most

// A finger that holds on to the skin, and is pulled anywhere.
class Grip extends Finger {
  constructor(surface, place) {
    super(surface, place, 0);
    this.way = this.frame[0];
  }

  get direction() {
    return this.way;
  }

  tiltBy() {}

  // so much further [m]
  pull(by, most) {
    const pulled = sum(this.way.map((x) => x * this.depth), by), far = norm(pulled);
    if (far) this.way = unit(pulled);
    this.depth = this.wish = Math.min(far, most);
    this.shown = Math.min(this.shown, this.depth); // the way has turned at once, and no step is larger than the pull
  }
}

const pullOnScreen = (stage, grip, dx, dy, [, , w, h]) => {
  const [right, up] = stage.camera.rows, pixel = stage.camera.pixel(w, h);
  stage.changed();
  grip.pull(sum(right.map((x) => x * dx * pixel), up, -dy * pixel), PULL_MOST * stage.main.model.info.peak_m);
};

// The points of a path that it does not stray from by more than `far` [m] (Douglas and Peucker 1973).
const thinned = (path, far) => {
  if (path.length < 3) return path;
  const [first, last] = [path[0], path.at(-1)], along = unit(sum(last, first, -1));
  const away = path.map((point) => {
    const from = sum(point, first, -1);
    return norm(sum(from, along, -clamp(dot(from, along), 0, norm(sum(last, first, -1)))));
  });
  const worst = away.indexOf(Math.max(...away));
  if (away[worst] <= far) return [first, last];
  return [...thinned(path.slice(0, worst + 1), far).slice(0, -1), ...thinned(path.slice(worst), far)];
};

// Nodes that were at one place, place by place.
const placesOf = ({ nodes }) => {
  const places = new Map();
  for (let i = 0; i < nodes.length; i += 3) {
    const key = [0, 1, 2].map((k) => Math.round(1e6 * nodes[i + k])).join();
    if (!places.has(key)) places.set(key, []);
    places.get(key).push(i / 3);
  }
  return [...places.values()];
};

// The largest distance [m] between two nodes of lips that were at one place.
const openingOf = ({ model, places }) => {
  const apart = (i, j) => Math.hypot(...[0, 1, 2].map((k) => places[3 * i + k] - places[3 * j + k]));
  const lips = placesOf(model).map((here) => here.filter((node) => node >= model.skin));
  return Math.max(0, ...lips.map((here) => Math.max(0, ...here.slice(1).map((node) => apart(here[0], node)))));
};

Object.assign(Stage.prototype, { cuts: [], trace: null, severed: null, refused: "" });

Object.assign(Stage.prototype, {
  // the choices that follow a knife
  knives() {
    return this.choices.filter((choice) => choice.head.knife);
  },

  blade() {
    return this.bladeSet ?? BLADE[1] * this.camera.extent;
  },

  // The knife is at a place of the skin, or beside the body: there its path goes on a little and ends.
  // dx, dy : the way on the screen that it came
  cutTo(place, dx, dy) {
    const { main, trace, camera } = this, [right, up] = camera.rows;
    if (trace.left) return;
    const on = place && main.surface.triangles[3 * place.triangle] < (main.model.skin ?? Infinity) ? place : null;
    const way = unit(sum(right.map((x) => x * dx), up, -dy)), far = BEYOND * camera.extent;
    if (on) {
      const finger = new Finger(main.surface, on, 0);
      if (!trace.path.length && trace.outside) trace.path.push(sum(finger.rest, way, -far));
      trace.path.push(finger.rest);
      trace.shown.push(finger);
    } else if (!trace.path.length) trace.outside = true;
    else if (!place) {
      trace.left = true;
      trace.path.push(sum(trace.path.at(-1), way, far));
    }
    this.redraw();
  },

  beginCut() {
    [this.trace, this.refused] = [{ path: [], shown: [], outside: false, left: false }, ""];
  },

  async endCut() {
    const { trace, camera } = this;
    this.trace = null;
    this.redraw();
    if (!trace || trace.path.length < 2) return;
    let [far, path] = [STRAY * camera.extent, trace.path];
    do [path, far] = [thinned(trace.path, far), 1.5 * far]; while (path.length > PATH_POINTS);
    const rounded = path.map((point) => point.map((x) => +x.toFixed(6)));
    await this.sever([...this.cuts, { path_m: rounded, depth_m: +this.blade().toFixed(5) }]);
  },

  // Let all models that are shown have these cuts; one that follows no knife is not shown beside a cut body.
  async sever(cuts) {
    if (this.severing) return;
    this.severing = true;
    this.panel.tellKnife();
    if (cuts.length && this.besides && !this.besides.head.knife) this.compare(null);
    try {
      let took = null;
      for (const { model } of this.views) if (model.cut) took = (await model.cut(cuts)) ?? took;
      [this.cuts, this.refused] = [cuts, ""];
      this.severed = took && { ...took, first: null, whole: !cuts.length };
      this.uncover();
    } catch (error) {
      this.refused = error.message;
    }
    this.severing = false;
    if (!this.refused) this.even(); // another model may have been chosen meanwhile
    this.panel.choose();
    this.refresh();
  },

  // What is shown beside or instead of a cut body has its cuts, too; where it can follow none, the body is whole again.
  even() {
    const cuts = [this.choice, this.besides].every((choice) => !choice || choice.head.knife) ? this.cuts : [];
    const same = (each) => JSON.stringify(each) === JSON.stringify(cuts);
    if (!same(this.cuts) || !this.views.every(({ model }) => !model.cut || same(model.cuts))) this.sever(cuts);
  },

  // Show the surfaces that models have now; nothing presses them yet.
  uncover() {
    [this.fingers, this.active, this.truth, this.truthShown, this.cursor, this.times] = [[], null, null, false, null, []];
    this.main = new View(this.painter, this.main.model, this.held);
    this.beside &&= new View(this.painter, this.beside.model, this.held);
    if (this.cursorSeen) this.aim();
  },

  // the rims of cuts that face the viewer, as lines from pixel to pixel, so that lips which touch are seen, too
  rims() {
    const { clientWidth, clientHeight } = this.panel.canvas;
    return this.views.flatMap((view, v) => {
      const [left, top, w, h] = this.box(v, clientWidth, clientHeight);
      const facing = (node) => dot(view.normals.subarray(3 * node), this.camera.rows[2]) > 0;
      const pixel = (node) => this.camera.project(view.places.subarray(3 * node), w, h);
      return (view.model.rims ?? []).filter((ends) => ends.every(facing)).map((ends) => {
        const [[ax, ay], [bx, by]] = ends.map(pixel);
        return [left + ax, top + ay, left + bx, top + by];
      });
    });
  },

  // the way of the knife so far, as lines from pixel to pixel
  traced() {
    if (!this.trace) return [];
    const { clientWidth, clientHeight } = this.panel.canvas, [left, top, w, h] = this.box(0, clientWidth, clientHeight);
    const pixels = this.trace.shown.map((finger) => this.camera.project(finger.mix(this.main.places), w, h));
    return pixels.slice(1).map(([x, y], i) => [left + pixels[i][0], top + pixels[i][1], left + x, top + y]);
  },
});

Object.assign(Panel.prototype, {
  // the depth of the knife, what undoes it, and what it did or why it cannot
  knife() {
    const { stage } = this;
    this.bladeDeep = this.slider("blade", 1, (value) => {
      stage.bladeSet = value;
      this.tellKnife();
    });
    this.mend = make("button", { type: "button", textContent: "Make whole" });
    this.mend.addEventListener("click", () => stage.sever([]));
    this.knifeNote = make("p", { className: "advice" });
    this.knifeNote.setAttribute("role", "status");
    const sliders = make("div", { className: "sliders" }, this.bladeDeep[2]);
    return make("div", { className: "knife", hidden: !stage.knives().length }, sliders, make("div", { className: "controls" }, this.mend), this.knifeNote);
  },

  tellKnife() {
    const { stage } = this, [slider, value] = this.bladeDeep;
    if (!stage.knives().length || !stage.main) return;
    const follows = Boolean(stage.choice.head.knife), [least, , most] = BLADE.map((share) => share * stage.camera.extent);
    Object.assign(slider, { min: least, max: most, disabled: !follows });
    if (document.activeElement !== slider) slider.value = stage.blade();
    value.textContent = said(1e3 * stage.blade(), "mm");
    this.radios.cut[0].disabled = !follows;
    this.mend.disabled = !stage.cuts.length || stage.severing;
    const words = this.knifeWords(follows);
    if (this.knifeNote.textContent !== words) this.knifeNote.textContent = words;
    this.knifeNote.classList.toggle("refused", Boolean(stage.refused));
  },

  knifeWords(follows) {
    const { stage } = this, { severed, main } = stage;
    const others = stage.knives().map(({ title }) => `“${title}”`).join(" or ");
    if (!follows) return `This model was prepared for the whole body and follows no knife; choose ${others}.`;
    if (stage.severing) return "Cutting …";
    if (stage.refused) return stage.refused[0].toUpperCase() + stage.refused.slice(1);
    if (!severed) return stage.mode === "cut" ? "Drag over the skin: the knife cuts along the way. Then pull." : "";
    const ms = (time) => said(Math.round(10 * time) / 10, "ms");
    if (!severed.first && main.answer.forces.length && stage.times.length) [severed.first] = stage.times;
    const first = severed.first ? `first answer ${ms(severed.first)}` : "now pull, or press";
    if (severed.whole) return `Whole again in ${ms(severed.ms)}; ${first}.`;
    const opening = openingOf(main), apart = opening > 1e-5 ? ` The lips are ${said(1e3 * opening, "mm")} apart at most.` : "";
    return `Cut in ${ms(severed.ms)}, drawn in ${ms(severed.drawn_ms)}; ${first}.${apart}`;
  },
});
