// The stage: models, fingers and views, and the loop that asks and draws, one picture after the other.
const INKS = { active: [1, 1, 1], other: [1, 0.72, 0.2], cursor: [0.35, 0.95, 0.75] };
const DEEPEST = 1.2; // as deep as a reader may go on, over what a place is known to bear
const FREE = 0.5; // what a place bears over the largest displacement, where no model says
const FIRST = 0.4, CAREFUL = 0.15; // depth of the first press over the same, and where no model says
const EASE = 0.35; // of the way to the depth that is asked for, in each picture
const AROUND_PX = 4; // pixels to either side of a ring's line in which it is drawn, on however steep a surface
const still = matchMedia("(prefers-reduced-motion: reduce)");

class Stage {
  constructor(figure) {
    this.figure = figure;
    this.head = JSON.parse(figure.querySelector("script.head").textContent);
    this.held = bytesOf(this.head.held); // a byte for each node
    this.palettes = Object.fromEntries(Object.entries(this.head.palettes).map(([name, text]) => [name, bytesOf(text)]));
    this.choices = this.head.models.map((head) => new Choice(figure, head));
    Object.assign(this, { fingers: [], active: null, mode: "press", colour: "displacement", besides: null });
    Object.assign(this, { truth: null, truthShown: false, stale: false, busy: false, pictures: 0, times: [] });
    this.panel = new Panel(this);
    this.painter = new Painter(this.panel.canvas);
    if (!this.painter.gl) {
      this.panel.warn("This browser draws no WebGL, and so no organ to press.");
      return;
    }
    this.panel.canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    this.panel.canvas.addEventListener("webglcontextrestored", () => this.restore());
    this.open();
  }

  // The first model is unpacked when the page has been drawn, so that it is ready before anybody presses.
  open() {
    const begin = () => {
      try {
        this.take(this.choices[0]);
      } catch (error) {
        this.panel.warn(error.message);
        return;
      }
      listen(this);
      new ResizeObserver(() => this.resize()).observe(this.panel.canvas);
    };
    requestAnimationFrame(() => setTimeout(begin));
  }

  restore() {
    this.painter.build();
    this.views.forEach((view) => view.upload());
    this.refresh();
  }

  get views() {
    return [this.main, this.beside].filter(Boolean);
  }

  // what a key or a notch of the wheel adds to the depth [m]
  get step() {
    return 0.04 * this.main.model.info.peak_m;
  }

  // how deep a place is known to bear a press [m], by the model or another that is loaded; asked for with each move of a
  // pointer, and worked out once for a place
  bears(place) {
    const { model, depths, surface: { nodes, triangles } } = this.main, free = FREE * model.info.peak_m;
    if (!place) return free;
    if (this.active?.touch?.deepest && place === this.active.place) return this.active.touch.deepest;
    if (isHeld(triangles, 3 * place.triangle, this.main.held)) return 0;
    if (!depths.has(place)) {
      const loaded = [model, ...this.choices.map((choice) => choice.loaded)];
      const knows = loaded.find((each) => each?.depth && each.nodes.length === nodes.length);
      if (!knows) return free; // and not kept, as one may be loaded later
      depths.set(place, knows.depth(place));
    }
    return depths.get(place);
  }

  // how deep the active finger can press [m]
  get most() {
    return DEEPEST * this.bears(this.active?.place);
  }

  // Let another model answer the same presses, as far as it is known to bear them.
  take(choice) {
    const { model } = choice, size = (each) => each?.whole ?? each?.nodes.length, before = this.main?.model;
    const same = size(before) === size(model), uncut = before?.triangles.length === model.triangles.length;
    this.choice = choice;
    this.main = new View(this.painter, model, this.held);
    this.depth ??= (model.depth ? FIRST : CAREFUL) * model.info.peak_m;
    this.times = [];
    if (!same) {
      this.camera = new Camera(model.nodes, this.held);
      [this.fingers, this.active, this.truth] = [[], null, null];
    }
    if (!uncut) [this.fingers, this.active] = [[], null];
    for (const finger of this.fingers) {
      finger.surface = this.main.surface;
      finger.depth = Math.min(finger.wish, this.bears(finger.place)); // what another model did not bear comes back
    }
    if (this.tool && !this.tools()[this.tool]) [this.tool, this.fingers, this.active] = [null, [], null];
    this.panel.show(choice);
    this.even();
    this.refresh();
  }

  compare(choice) {
    this.besides = choice;
    this.beside = choice && new View(this.painter, choice.model, this.held);
    if (this.colour === "between" && !choice) this.colour = "displacement";
    this.panel.choose();
    this.even();
    this.refresh();
  }

  // Press a place: with the finger that is not pinned, or with a new one. At most two press at once. A finger takes its wish
  // along, as far as the place is known to bear it.
  put(place, own = null) {
    if (this.tool) return this.putTool(place);
    this.changed();
    const kept = this.fingers.filter((finger) => !finger.leaving);
    let finger = own ?? kept.find((each) => !each.pinned);
    if (!finger && kept.length === 2) finger = this.active;
    const pulls = this.mode === "pull";
    if (!finger || (!own && pulls !== finger instanceof Grip)) {
      const others = kept.filter((each) => each !== finger);
      finger = pulls ? new Grip(this.main.surface, place) : new Finger(this.main.surface, place, this.depth);
      this.fingers = [...others, finger];
    }
    finger.place = place;
    finger.depth = Math.min(finger.wish, this.bears(place));
    this.active = finger;
    return finger;
  }

  // Another press than that of which the truth is known.
  changed() {
    if (this.truth) {
      const { active } = this, depth = clamp(this.panel.depthOf(active), 0, this.most);
      Object.assign(active, { force: null, wish: depth, depth, shown: depth });
      [this.depth, this.truth, this.truthShown] = [depth, null, false];
      if (this.colour === "truth") this.colour = "displacement";
      this.panel.choose();
    }
    this.refresh();
  }

  // The reader asks for more or less, beyond what is known if need be; a place that bears little, or is held, takes nothing
  // from the wish for the next one.
  deepen(by) {
    if (!this.active) return;
    this.changed();
    const { active } = this, depth = clamp(active.depth + by, 0, this.most);
    this.depth = active.wish = depth < active.depth ? depth : Math.max(active.wish, depth);
    active.depth = depth;
  }

  release() {
    if (!this.fingers.length) return;
    this.changed();
    this.fingers.forEach((finger) => (finger.leaving = true));
    this.active = null;
    this.panel.choose();
    this.refresh();
  }

  // Press as in a sample whose truth was simulated.
  recall(truth) {
    this.tool = null;
    const finger = new Finger(this.main.surface, { triangle: truth.triangle, weights: truth.weights }, 0);
    finger.force = truth.force;
    [this.fingers, this.active, this.truth, this.truthShown] = [[finger], finger, truth, false];
    this.refresh();
  }

  refresh() {
    this.stale = true;
    this.redraw();
  }

  redraw() {
    this.waiting ??= requestAnimationFrame((now) => {
      this.waiting = null;
      this.picture(now);
    });
  }

  // One picture: fingers move on, models answer, the surface bends. Answers and drawing are timed apart.
  async picture(now) {
    if (this.busy) {
      this.again = true;
      return;
    }
    this.busy = true;
    if (this.stale || this.moves) this.pace(now);
    this.moves = false;
    if (this.stale) {
      const share = still.matches ? 1 : EASE;
      this.stale = this.fingers.map((finger) => !finger.force && finger.ease(share)).some(Boolean);
      this.fingers = this.fingers.filter((finger) => !finger.leaving || finger.shown > 0);
      const pressing = this.fingers.filter((finger) => finger.force || finger.shown > 1e-7);
      await Promise.all(this.views.map((view) => view.ask(pressing.map((finger) => finger.press))));
      this.pressing = pressing;
      if (this.main.answer.ms >= 0) this.times = [...this.times.slice(-30), this.main.answer.ms];
    }
    this.draw();
    this.busy = false;
    if (this.stale || this.again) this.redraw();
    this.again = false;
  }

  draw() {
    const { canvas } = this.panel, { width, height } = canvas;
    if (!width || !this.main) return;
    const sharp = width / canvas.clientWidth, rings = this.rings();
    this.painter.begin();
    this.views.forEach((view, i) => {
      const legend = this.bend(view, i);
      if (i === 0) this.panel.legend(legend);
      if (i === 1) this.panel.besideLegend(legend);
      const box = this.box(i, width, height);
      const doubt = view.answer.doubt && !(this.truthShown && i === 0);
      const crossed = view.cross(rings.rings, rings.count, AROUND_PX * this.camera.pixel(box[2], box[3]) * sharp);
      const marks = { ...rings, crossed, doubt, sharp };
      this.painter.paint(view.buffers, this.camera, [box[0], height - box[1] - box[3], box[2], box[3]], marks);
    });
    this.drawTool();
    this.painter.arrows.draw(this.rims(), sharp, { head: 0, wide: 0.5, ink: RIM });
    this.painter.arrows.draw(this.panel.shafts(), sharp);
    this.painter.arrows.draw(this.traced(), sharp, { head: 0 });
    this.pictures++;
    this.panel.tell();
  }

  bend(view, i) {
    const truth = i === 0 && this.truthShown ? this.truth.displacement : null;
    const kind = i === 1 && this.colour === "between" ? "between" : this.colour === "between" ? "displacement" : this.colour;
    const other = { truth: this.truth?.displacement, between: this.main.answer.displacement }[kind];
    const most = view.bend(truth ?? view.answer.displacement, other);
    const legend = colouring(kind, view, this.palettes, this.truth, most);
    view.most = other ? largest(view.answer.displacement) : most;
    view.shade(legend, this.camera.rows);
    return legend;
  }

  // where a view lies on the canvas: left, top, width and height in its pixels
  box(i, width, height) {
    if (!this.beside) return [0, 0, width, height];
    const half = Math.floor((width > 1.25 * height ? width : height) / 2);
    return width > 1.25 * height ? [i * half, 0, half, height] : [0, i * half, width, half];
  }

  rings() {
    const rings = new Float32Array(12), inks = new Float32Array(9), radius = this.active?.touch?.radius ?? this.main.model.info.radius_m;
    const shown = this.fingers.map((finger) => [finger.rest, finger === this.active ? INKS.active : INKS.other]);
    if (this.cursorSeen && this.cursor && (this.mode === "cut" || !(this.active && !this.active.pinned))) shown.push([this.cursor.rest, INKS.cursor]);
    shown.slice(0, 3).forEach(([place, ink], i) => {
      rings.set([...place, radius], 4 * i);
      inks.set(ink, 3 * i);
    });
    return { rings, inks, count: Math.min(3, shown.length) };
  }
}
