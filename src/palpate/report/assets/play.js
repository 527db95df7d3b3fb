// How a view's frames are chosen: a motion plays, and of several methods and samples one is picked.
Object.assign(View.prototype, {
  addPlayer() {
    const { times_s: times } = this.head.frames;
    this.player = make("button", { type: "button", textContent: "Play" });
    this.slider = make("input", { type: "range", min: 0, max: times.length - 1, step: 1, title: "moment" });
    this.slider.addEventListener("input", () => {
      this.stop();
      this.show(Number(this.slider.value));
    });
    this.player.addEventListener("click", () => (this.playing ? this.stop() : this.play()));
    this.bar.append(this.player, this.slider);
  },

  addChoices() {
    this.choices = Object.entries(this.head.frames.choices).map(([name, options]) => {
      const choice = make("select", {}, ...options.map((text) => make("option", { textContent: text })));
      choice.addEventListener("change", () => this.show(this.chosen()));
      this.bar.append(make("label", {}, `${name} `, choice));
      return choice;
    });
  },

  // The frames lie row by row: all options of the last choice for the first option of the first one, and so on.
  chosen() {
    return this.choices.reduce((frame, choice) => frame * choice.options.length + choice.selectedIndex, 0);
  },

  tell() {
    const { times_s: times, notes, note } = this.head.frames;
    if (times) {
      this.slider.value = this.frame;
      this.note.textContent = `${times[this.frame].toFixed(2)} s${this.playing && note ? `, ${note}` : ""}`;
      return;
    }
    let rest = this.frame;
    for (const choice of [...this.choices].reverse()) {
      choice.selectedIndex = rest % choice.options.length;
      rest = Math.floor(rest / choice.options.length);
    }
    this.note.textContent = notes[this.frame];
  },

  play() {
    if (!this.surface) return;
    const { times_s: times, pace } = this.head.frames;
    const last = times.length - 1;
    const from = this.frame === last ? 0 : this.frame;
    const began = performance.now() - 1000 * pace * (times[from] - times[0]);
    this.playing = true;
    this.player.textContent = "Pause";
    const step = (now) => {
      if (!this.playing) return;
      const time = times[0] + Math.max(0, now - began) / 1000 / pace;
      const next = times.findIndex((other) => other > time);
      const frame = next < 0 ? last : Math.max(0, next - 1);
      if (frame !== this.frame) this.show(frame);
      if (next < 0) this.stop();
      else requestAnimationFrame(step);
    };
    this.show(from);
    requestAnimationFrame(step);
  },

  stop() {
    this.playing = false;
    this.player.textContent = "Play";
    this.tell();
  },
});

document.querySelectorAll("figure.turn").forEach((figure) => new View(figure).watch());
