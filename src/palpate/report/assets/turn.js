// Views that turn: drag, or the arrow keys; + and − zoom, 0 goes back, space plays.
const TURN = 0.01, KEY_TURN = 0.12, ZOOM = 1.15, HELD = 255;
let painter;

class View {
  constructor(figure) {
    this.figure = figure;
    this.head = JSON.parse(figure.querySelector("script").textContent);
    const { legend, frames, window } = this.head;
    this.palette = Uint8Array.from(atob(legend.palette), (letter) => letter.charCodeAt(0));
    this.canvas = make("canvas", { tabIndex: 0 });
    this.canvas.style.aspectRatio = Math.max(1.35, Math.min(2.2, window[0] / window[1]));
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `${figure.dataset.title}: a view to turn with the arrow keys`);
    this.note = make("output");
    this.bar = make("div", { className: "controls" });
    if (frames.times_s) this.addPlayer();
    else this.addChoices();
    this.bar.append(this.note);
    const place = make("div", { className: "stage" }, this.canvas, this.bar, this.key(legend));
    figure.prepend(place);
    this.reset();
    this.listen();
  }

  // Its picture is made when it comes into sight for the first time, and whenever its size changes.
  watch() {
    const seen = new IntersectionObserver(async ([entry]) => {
      if (!entry.isIntersecting) return;
      seen.disconnect();
      await this.open();
    });
    seen.observe(this.canvas);
  }

  async open() {
    painter ??= new SharedCanvas();
    if (!painter.gl) {
      this.note.textContent = "This browser draws no WebGL; the pictures show the same.";
      return;
    }
    this.surface = await surface(this.head);
    const { corners, frames } = this.surface;
    this.place = new Float32Array(corners.length * 3);
    this.colour = new Float32Array(corners.length * 3);
    // thirds of a triangle, from which edges are found; those of rigid things have none
    this.corner = Float32Array.from({ length: corners.length * 3 }, (_, i) =>
      i >= this.head.bare * 9 || i % 9 === 0 || i % 9 === 4 || i % 9 === 8 ? 1 : 0);
    this.show(Math.min(this.head.frames.start, frames - 1));
    new ResizeObserver(() => this.resize()).observe(this.canvas);
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas;
    const sharp = Math.min(window.devicePixelRatio || 1, 2);
    this.canvas.width = Math.max(1, Math.round(clientWidth * sharp));
    this.canvas.height = Math.max(1, Math.round(clientHeight * sharp));
    this.draw();
  }

  show(frame) {
    this.frame = frame;
    const { corners, places, shades, vertices } = this.surface;
    const shade = (i) => shades[frame * vertices + corners[i]];
    corners.forEach((vertex, i) => {
      const from = (frame * vertices + vertex) * 3, first = i - (i % 3);
      // only what is held at all its corners is dark; other corners that are held stay where they were
      const held = shade(i) === HELD && !(shade(first) === HELD && shade(first + 1) === HELD && shade(first + 2) === HELD);
      const tint = held ? 0 : shade(i) * 3;
      for (let k = 0; k < 3; k++) {
        this.place[i * 3 + k] = places[from + k];
        this.colour[i * 3 + k] = this.palette[tint + k] / 255;
      }
    });
    this.tell();
    this.draw();
  }

  draw() {
    if (!this.surface || !this.canvas.width) return;
    const { centre, window } = this.head, { width, height } = this.canvas;
    const pixel = Math.max(window[0] / width, window[1] / height) / this.zoom;
    const reach = 4 * Math.max(...window);
    painter.paint(this.canvas, {
      place: this.place, colour: this.colour, corner: this.corner, centre,
      turn: turned(this.base, this.yaw, this.pitch),
      scale: [2 / (pixel * width), 2 / (pixel * height), 1 / reach],
      lines: Math.min(0.3, 300 / this.head.counts[2]), // the edges of more would darken it
    });
  }

  reset() {
    [this.base, this.pitch] = upright(this.head.axes);
    this.yaw = 0;
    this.zoom = 1;
    this.draw();
  }

  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.max(-1.57, Math.min(1.57, this.pitch + pitch));
    this.draw();
  }

  listen() {
    let last = null;
    this.canvas.addEventListener("pointerdown", (event) => {
      last = event;
      this.canvas.setPointerCapture(event.pointerId);
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (!last) return;
      this.turn((event.clientX - last.clientX) * TURN, (event.clientY - last.clientY) * TURN);
      last = event;
    });
    for (const end of ["pointerup", "pointercancel"]) this.canvas.addEventListener(end, () => (last = null));
    const keys = {
      ArrowLeft: () => this.turn(-KEY_TURN, 0), ArrowRight: () => this.turn(KEY_TURN, 0),
      ArrowUp: () => this.turn(0, -KEY_TURN), ArrowDown: () => this.turn(0, KEY_TURN),
      "+": () => this.magnify(ZOOM), "-": () => this.magnify(1 / ZOOM), 0: () => this.reset(),
      " ": () => this.player?.click(),
    };
    this.canvas.addEventListener("keydown", (event) => {
      if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      keys[event.key]();
    });
    // the wheel scrolls the page unless the view was clicked
    this.canvas.addEventListener("wheel", (event) => {
      if (document.activeElement !== this.canvas) return;
      event.preventDefault();
      this.magnify(event.deltaY < 0 ? ZOOM : 1 / ZOOM);
    }, { passive: false });
  }

  magnify(factor) {
    this.zoom = Math.max(0.5, Math.min(8, this.zoom * factor));
    this.draw();
  }

  key({ label, ticks }) {
    const colours = Array.from({ length: 17 }, (_, i) => {
      const at = Math.round((i * 253) / 16) * 3;
      return `rgb(${this.palette.slice(at, at + 3).join()})`;
    });
    const bar = make("div", { className: "bar" });
    bar.style.background = `linear-gradient(to right, ${colours.join()})`;
    const marks = ticks.map(([share, text]) => {
      const mark = make("span", { textContent: text });
      mark.style.left = `${100 * share}%`;
      return mark;
    });
    return make("div", { className: "legend" }, bar, make("div", { className: "ticks" }, ...marks), label);
  }
}

// View axes (right, up, toward the viewer) set upright, and the angle [rad] from which they looked down.
const upright = ([right, up, toward]) => {
  const axis = up.map(Math.abs).indexOf(Math.max(...up.map(Math.abs)));
  const sky = [0, 1, 2].map((k) => (k === axis ? Math.sign(up[axis]) : 0));
  const depth = [0, 1, 2].map((k) => right[(k + 1) % 3] * sky[(k + 2) % 3] - right[(k + 2) % 3] * sky[(k + 1) % 3]);
  return [[right, sky, depth], Math.asin(toward[axis] * sky[axis])];
};

// The rows of `axes` (right, up, toward the viewer), turned about the view's up and then its right; 9 numbers.
const turned = (axes, yaw, pitch) => {
  const [c, s, d, t] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
  const mix = [[c, 0, s], [t * s, d, -t * c], [-d * s, t, d * c]];
  return mix.flatMap((row) => [0, 1, 2].map((k) => row.reduce((sum, share, j) => sum + share * axes[j][k], 0)));
};
