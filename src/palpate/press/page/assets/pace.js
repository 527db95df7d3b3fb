// How many pixels are drawn: fewer while things move and pictures come slowly, and more at rest, for smooth edges.
const DETAILS = [1, 0.75, 0.6]; // of the screen's pixels along a side, while things move
const REST = 2, REST_MS = 250; // the same at rest, and when that begins
const SLOW_MS = 19, JUDGED = 8; // pictures that are judged at once, by the median of what lies between two
Object.assign(Stage.prototype, { level: 0, last: 0, gaps: [] });

Object.assign(Stage.prototype, {
  // Choose the detail of a picture of something that moves; each rest tries more again.
  pace(now) {
    const gap = now - this.last;
    this.last = now;
    this.gaps = gap < REST_MS ? [...this.gaps, gap] : [];
    if (this.gaps.length === JUDGED) {
      const median = this.gaps.sort((a, b) => a - b)[JUDGED >> 1];
      if (median > SLOW_MS) this.level = Math.min(this.level + 1, DETAILS.length - 1);
      this.gaps = [];
    }
    this.resize(DETAILS[this.level] * Math.min(window.devicePixelRatio || 1, 2));
    clearTimeout(this.resting);
    this.resting = setTimeout(() => {
      this.level = Math.max(0, this.level - 1);
      this.resize();
    }, REST_MS);
  },

  resize(detail = REST) {
    const { canvas } = this.panel;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((size) => Math.max(1, Math.round(size * detail)));
    if (canvas.width === width && canvas.height === height) return;
    [canvas.width, canvas.height] = [width, height];
    if (this.beside) this.panel.resized();
    this.redraw();
  },
});
