// What pointers, the wheel and keys do to the stage.
const TURN = 0.01, KEY_TURN = 0.12, ZOOM = 1.15, NEAR_PX = 26, KEY_SLIDE_PX = 7, KEY_TILT = 0.07, TILT_PX = 0.008;
const DRAG_PX = 3; // nearer to where it began, a pointer that trembles asks for no other depth
const MODES = ["press", "slide", "tilt", "turn", "pull", "cut"];

// The view under a pixel of the canvas (CSS pixels), and what of the body lies there.
const under = (stage, x, y) => {
  const { clientWidth, clientHeight } = stage.panel.canvas;
  const boxes = stage.views.map((_, i) => stage.box(i, clientWidth, clientHeight));
  const found = boxes.findIndex(([left, top, w, h]) => x >= left && x < left + w && y >= top && y < top + h);
  const i = Math.max(0, found), [left, top, w, h] = boxes[i], view = stage.views[i];
  const place = stage.camera.pick(view.places, view.surface.triangles, x - left, y - top, w, h);
  return { view, place, box: boxes[i] };
};

const onScreen = (stage, finger, { view, box: [left, top, w, h] }) => {
  const [x, y] = stage.camera.project(finger.mix(view.places), w, h);
  return [left + x, top + y];
};

// The depth [m] that a drag by some pixels adds: along the press as it is seen or, head on, downwards.
const deeper = (stage, finger, dx, dy, [, , w, h]) => {
  const [right, up] = stage.camera.rows, push = finger.direction;
  const seen = [dot(right, push), -dot(up, push)], length = Math.hypot(...seen);
  const [ux, uy] = length > 0.4 ? seen.map((value) => value / length) : [0, 1];
  return 0.6 * (dx * ux + dy * uy) * stage.camera.pixel(w, h);
};

const tiltOnScreen = (stage, finger, dx, dy) => {
  const [right, up] = stage.camera.rows;
  finger.tiltBy(sum(right.map((x) => x * dx), up, -dy));
  stage.changed();
};

// Move a finger, or the cursor, to what lies some pixels further.
const slideOnScreen = (stage, finger, dx, dy) => {
  const { clientWidth, clientHeight } = stage.panel.canvas;
  const seen = { view: stage.main, box: stage.box(0, clientWidth, clientHeight) };
  const [x, y] = onScreen(stage, finger, seen), { place } = under(stage, x + dx, y + dy);
  if (!place) return;
  if (finger !== stage.cursor) return stage.put(place, finger);
  finger.place = place;
  stage.redraw();
};

const listen = (stage) => {
  const { canvas } = stage.panel, pointers = new Map();
  const at = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  // the finger that a pointer takes: one that is there already, or one that is put there
  const grab = (seen, x, y, surely) => {
    const near = stage.fingers.find((finger) => {
      const [fx, fy] = onScreen(stage, finger, seen);
      const holds = stage.mode !== "pull" || finger instanceof Grip;
      return holds && !finger.leaving && Math.hypot(fx - x, fy - y) < NEAR_PX;
    });
    if (near) {
      stage.active = near;
      stage.refresh();
      return near;
    }
    const busy = [...pointers.values()].map((pointer) => pointer.finger).filter(Boolean);
    busy.forEach((finger) => (finger.pinned = true));
    const finger = stage.put(seen.place);
    finger.shown = surely ? finger.shown : 0;
    return finger;
  };

  canvas.addEventListener("pointerdown", (event) => {
    const [x, y] = at(event), seen = under(stage, x, y);
    const cuts = stage.mode === "cut" && event.pointerType !== "touch"; // a mouse may begin beside the body
    const does = !(seen.place || cuts) || stage.mode === "turn" || event.button ? "turn" : stage.mode;
    // a touch beside the organ that goes up or down scrolls the page
    const upright = seen.place || event.pointerType !== "touch" ? 1 : 0;
    const pointer = { x, y, does, upright, box: seen.box, finger: null, drags: false };
    if (does === "cut") {
      stage.beginCut();
      stage.cutTo(seen.place, 0, 0);
    } else if (does !== "turn") pointer.finger = grab(seen, x, y, does === "slide");
    pointers.set(event.pointerId, pointer);
    if (event.isTrusted) canvas.setPointerCapture(event.pointerId);
    stage.panel.choose();
  });
  canvas.addEventListener("pointermove", (event) => {
    const pointer = pointers.get(event.pointerId);
    if (!pointer) return;
    const [x, y] = at(event), dx = x - pointer.x, dy = y - pointer.y, { finger } = pointer;
    pointer.drags ||= pointer.does !== "press" || Math.hypot(dx, dy) > DRAG_PX;
    if (!pointer.drags) return;
    Object.assign(pointer, { x, y });
    if (finger) stage.active = finger;
    if (pointer.does === "turn") {
      stage.look((camera) => camera.turn(dx * TURN, dy * TURN * pointer.upright));
    } else if (pointer.does === "press") stage.deepen(deeper(stage, finger, dx, dy, pointer.box));
    else if (pointer.does === "tilt") tiltOnScreen(stage, finger, dx * TILT_PX, dy * TILT_PX);
    else if (pointer.does === "pull") pullOnScreen(stage, finger, dx, dy, pointer.box);
    else if (pointer.does === "cut") stage.trace && stage.cutTo(under(stage, x, y).place, dx, dy);
    else {
      const { place } = under(stage, x, y);
      if (place) stage.put(place, finger);
    }
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => {
    if (pointers.get(event.pointerId)?.does === "cut") stage.endCut();
    pointers.delete(event.pointerId);
  });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  // a touch of the organ presses it; one beside it scrolls the page
  canvas.addEventListener("touchstart", (event) => {
    const hits = [...event.changedTouches].some((touch) => under(stage, ...at(touch)).place);
    if (hits && event.cancelable) event.preventDefault();
  }, { passive: false });
  // the wheel scrolls the page unless the view was clicked
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas) return;
    event.preventDefault();
    if (stage.active && under(stage, ...at(event)).place) stage.deepen(-Math.sign(event.deltaY) * stage.step);
    else stage.look((camera) => camera.magnify(event.deltaY < 0 ? ZOOM : 1 / ZOOM));
  }, { passive: false });
  listenToKeys(stage);
};

const listenToKeys = (stage) => {
  const { canvas } = stage.panel;
  const box = () => stage.box(0, canvas.clientWidth, canvas.clientHeight);
  // the finger that keys move; beside a pinned one they move the cursor to where a second one shall press
  const free = () => (stage.active?.pinned ? null : stage.active);
  const arrow = (dx, dy) => {
    const finger = free(), { mode } = stage;
    if (mode === "turn") stage.look((camera) => camera.turn(dx * KEY_TURN, dy * KEY_TURN));
    else if (mode === "cut" && stage.cursor) {
      slideOnScreen(stage, stage.cursor, dx * KEY_SLIDE_PX, dy * KEY_SLIDE_PX);
      if (stage.trace) stage.cutTo(stage.cursor.place, dx, dy);
    } else if (!finger) stage.cursor && slideOnScreen(stage, stage.cursor, dx * KEY_SLIDE_PX, dy * KEY_SLIDE_PX);
    else if (mode === "slide") slideOnScreen(stage, finger, dx * KEY_SLIDE_PX, dy * KEY_SLIDE_PX);
    else if (mode === "tilt") tiltOnScreen(stage, finger, dx * KEY_TILT, dy * KEY_TILT);
    else if (mode === "pull" && finger instanceof Grip) pullOnScreen(stage, finger, dx * KEY_SLIDE_PX, dy * KEY_SLIDE_PX, box());
    else if (dy) stage.deepen(dy * stage.step);
    else stage.look((camera) => camera.turn(dx * KEY_TURN, 0));
  };
  const zoom = (factor) => stage.look((camera) => camera.magnify(factor));
  const home = () => stage.look((camera) => camera.reset());
  const toggle = () => {
    if (stage.mode === "cut" && stage.cursor) {
      if (stage.trace) return stage.endCut();
      stage.beginCut();
      stage.cutTo(stage.cursor.place, 0, 0);
    } else if (free()) stage.release();
    else if (stage.cursor) stage.put(stage.cursor.place).shown = 0;
  };
  const escape = () => {
    if (!stage.trace) return stage.release();
    stage.trace = null;
    stage.redraw();
  };
  const keys = {
    ArrowLeft: () => arrow(-1, 0), ArrowRight: () => arrow(1, 0), ArrowUp: () => arrow(0, -1), ArrowDown: () => arrow(0, 1),
    "+": () => zoom(ZOOM), "-": () => zoom(1 / ZOOM), 0: home, Enter: toggle, " ": toggle, Escape: escape,
    p: () => stage.pin(), t: () => stage.showTruth(!stage.truthShown),
  };
  MODES.forEach((mode, i) => (keys[i + 1] = () => !stage.panel.radios[mode]?.[0].disabled && stage.panel.radios[mode] && stage.choose(mode)));
  canvas.addEventListener("keydown", (event) => {
    if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    keys[event.key]();
    stage.panel.choose();
  });
  canvas.addEventListener("focus", () => canvas.matches(":focus-visible") && stage.aim());
  canvas.addEventListener("blur", () => {
    stage.cursorSeen = false;
    stage.redraw();
  });
};

// What the panel and keys ask of the stage beside presses.
Object.assign(Stage.prototype, {
  // The camera moves.
  look(move) {
    move(this.camera);
    this.moves = true;
    this.redraw();
  },

  choose(mode) {
    [this.mode, this.trace] = [mode, null];
    this.panel.choose();
  },

  // The cursor of the keyboard begins in the middle of what is seen.
  aim() {
    const { clientWidth, clientHeight } = this.panel.canvas, [, , w, h] = this.box(0, clientWidth, clientHeight);
    const tried = Array.from({ length: 300 }, (_, i) => [w / 2 + 3 * i ** 0.7 * Math.cos(i), h / 2 + 3 * i ** 0.7 * Math.sin(i)]);
    for (const [x, y] of this.cursor ? [] : tried) {
      const { place } = under(this, x, y);
      if (!place) continue;
      this.cursor = new Finger(this.main.surface, place, 0);
      break;
    }
    this.cursorSeen = true;
    this.redraw();
  },

  pin() {
    if (!this.active) return;
    this.changed();
    this.active.pinned = !this.active.pinned;
    this.panel.choose();
  },

  showTruth(shown) {
    if (!this.truth) return;
    this.truthShown = shown;
    this.panel.choose();
    this.redraw();
  },

  shadeBy(colour) {
    this.colour = colour;
    this.redraw();
  },
});
