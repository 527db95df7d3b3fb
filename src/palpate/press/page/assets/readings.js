// What the panel tells after each picture.
Object.assign(Panel.prototype, {
  // how far the middle of a finger has gone along its way [m]
  depthOf(finger) {
    if (!finger) return NaN;
    return finger.force ? dot(finger.mix(this.stage.main.answer.displacement), unit(finger.force)) : finger.shown;
  },

  // newtons of a finger that presses
  forceOf(finger) {
    const i = (this.stage.pressing ?? []).indexOf(finger), { forces } = this.stage.main.answer;
    return i < 0 || forces.length < 3 * i + 3 ? NaN : norm([...forces.slice(3 * i, 3 * i + 3)]);
  },

  // numbers change ten times a second at most
  tell() {
    this.telling ??= setTimeout(() => {
      this.telling = null;
      this.tellNumbers();
    }, 100);
  },

  tellNumbers() {
    const { stage } = this, { active, main } = stage;
    const { doubt, error } = active ? main.answer : { doubt: "", error: NaN };
    const newtons = this.forceOf(active), millimetres = 1e3 * this.depthOf(active);
    this.force.textContent = said(newtons, "N");
    this.depthShown(millimetres);
    const times = [...stage.times].sort((a, b) => a - b), median = times[times.length >> 1];
    this.answer.textContent = active ? said(Math.round(100 * median) / 100, "ms") : "–";
    this.error.textContent = error > 0 ? `± ${percent(error)}` : "–";
    this.bars(error);
    this.drawCurve();
    this.tellKnife();
    this.doubtShown(doubt);
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.speak(), AGAIN_MS);
  },

  depthShown(millimetres) {
    const { stage } = this, [slider, value] = this.deep;
    const asked = stage.truth ? this.depthOf(stage.active) : stage.active?.depth ?? stage.depth;
    const name = stage.active instanceof Grip ? "pull" : "depth";
    this.gone.previousSibling.textContent = this.deep[2].firstChild.textContent = name;
    this.gone.textContent = said(millimetres, "mm");
    slider.max = Math.max(stage.most, asked || 0);
    if (document.activeElement !== slider) slider.value = asked;
    value.textContent = said(1e3 * asked, "mm");
    if (!stage.active) return;
    const angles = stage.active.force ? [0, 0] : stage.active.angles;
    [this.angle, this.turned].forEach(([input, output], i) => {
      if (document.activeElement !== input) input.value = angles[i];
      output.textContent = `${Math.round(angles[i])}°`;
    });
  },

  // the estimated error on its bar, and the true one where it is known
  bars(error) {
    const { stage } = this, { main, truth } = stage;
    this.bar.style.width = error > 0 ? along(error) : "0";
    const actual = truth && main.answer.displacement ? rmseOfPeak(main.answer.displacement, truth.displacement) : NaN;
    this.trueBar.hidden = !(actual > 0);
    if (actual > 0) this.trueBar.style.left = along(actual);
    const peak = 1e3 * (main.most ?? 0);
    const truly = actual > 0 ? `truly ${percent(actual)} of the peak` : "";
    const marks = `error bar with marks at ${DECADES.map(percent).join(", ")} of the peak`;
    this.scale.setAttribute("aria-label", `${marks}: ${error > 0 ? `estimated ${percent(error)}` : "no estimate"}${truly && `, ${truly}`}`);
    const own = error > 0 ? `error over the surface ±\u00a0${said(error * peak, "mm")}` : "this model does not estimate its error";
    const told = [`moves ${said(peak, "mm")} at most`, main.answer.forces.length ? own : "", truly].filter(Boolean).join("; ");
    const pressed = stage.active && !(stage.most > 0) ? "here the organ is held, and cannot be pressed" : told;
    this.bound.textContent = stage.active ? pressed : "press the organ anywhere";
  },

  doubtShown(doubt) {
    this.doubt.hidden = !doubt || this.stage.truthShown;
    if (doubt) this.doubt.textContent = this.doubted(doubt);
  },

  // an answer that did not come is not one that is doubted
  doubted(doubt) {
    return `${this.stage.main.answer.lost ? "No new answer" : "The model doubts this answer"}: ${doubt}`;
  },

  // arrows that end where fingers press, as long as their force is large
  shafts() {
    const { stage } = this, { clientWidth, clientHeight } = this.canvas, hardest = stage.main.model.info.hardest_n;
    return stage.views.flatMap((view, v) => stage.fingers.map((finger) => {
      const [left, top, w, h] = stage.box(v, clientWidth, clientHeight);
      const place = finger.mix(view.places), newtons = this.forceOf(finger);
      const share = newtons > 0 && hardest > 0 ? newtons / hardest : finger.shown / stage.main.model.info.peak_m;
      const long = stage.camera.reach * (0.05 + 0.16 * Math.min(share, 1.6));
      const way = finger.force ? unit(finger.force) : finger.direction;
      const [x, y] = stage.camera.project(place, w, h), [fx, fy] = stage.camera.project(sum(place, way, -long), w, h);
      return finger instanceof Grip ? [left + x, top + y, left + 2 * x - fx, top + 2 * y - fy] : [left + fx, top + fy, left + x, top + y];
    }));
  },

  speak() {
    const { active, main } = this.stage, { doubt, error } = main.answer;
    const newtons = this.forceOf(active), millimetres = 1e3 * this.depthOf(active);
    const errors = error > 0 ? `, estimated error ${percent(error)} of the peak` : "";
    const text = active ? `${said(newtons, "newtons")}, ${said(millimetres, "millimetres")} ${active instanceof Grip ? "pulled" : "deep"}${errors}.` : "Nothing is pressed.";
    const whole = doubt ? `${text} ${this.doubted(doubt)}` : text;
    if (this.live.textContent !== whole) this.live.textContent = whole;
  },

  // the key of the colours
  legend(legend) {
    this.drawKey(this.key, legend);
  },

  besideLegend(legend) {
    this.drawKey(this.besideKey, legend);
    this.besideKey.hidden = this.besideKey.dataset.shown === this.key.dataset.shown;
  },

  drawKey(key, { palette, marks, words }) {
    const cut = this.stage.cuts.length > 0, text = words + marks.join() + cut;
    if (key.dataset.shown === text) return;
    key.dataset.shown = text;
    const count = palette.length / 3 - 1;
    const colours = Array.from({ length: 17 }, (_, i) => `rgb(${palette.slice(3 * Math.round((i * count) / 16), 3 * Math.round((i * count) / 16) + 3).join()})`);
    const bar = make("div", { className: "bar" });
    bar.style.background = `linear-gradient(to right, ${colours.join()})`;
    const ticks = marks.map(([share, value]) => {
      const mark = make("span", { textContent: value });
      mark.style.left = `${100 * share}%`;
      return mark;
    });
    const held = this.stage.held.some(Boolean) ? [make("span", { className: "held", textContent: "held" })] : [];
    const lips = cut ? [make("span", { className: "held lips", textContent: "lips of the cut" })] : [];
    key.replaceChildren(bar, make("div", { className: "ticks" }, ...ticks), make("span", { textContent: words }), ...held, ...lips);
  },

  // another model: its advice, its truths, the range of its depths
  show(choice) {
    this.model[0].value = choice.name;
    this.advice.textContent = choice.advice;
    this.known.hidden = !choice.truths.length;
    const names = choice.truths.map(({ title }, i) => make("option", { value: i, textContent: title }));
    this.samples[0].replaceChildren(make("option", { value: "", textContent: "choose a simulated press" }), ...names);
    this.choose();
  },

  // what is chosen is marked, and what cannot be chosen is not offered
  choose() {
    const { stage } = this, { truth, active } = stage;
    this.offerTools();
    if (stage.mode === "cut" && !stage.choice?.head.knife) stage.mode = "press";
    this.tellKnife();
    Object.entries(this.radios).forEach(([way, [radio]]) => (radio.checked = way === stage.mode));
    for (const each of [this.pin, this.let, this.angle[0], this.turned[0]]) each.disabled = !active;
    this.pin.setAttribute("aria-pressed", Boolean(active?.pinned));
    this.reveal.disabled = !truth;
    this.reveal.setAttribute("aria-pressed", Boolean(truth && stage.truthShown));
    this.reveal.textContent = stage.truthShown ? "Show the answer" : "Show the truth";
    this.truthNote.textContent = truth ? truth.note : "";
    if (!truth) this.samples[0].value = "";
    const offered = [["displacement", "displacement"], ["error", "displacement / error"]];
    if (truth) offered.push(["truth", "difference from the truth"]);
    if (stage.beside) offered.push(["between", "difference between both"]);
    const [colours] = this.colours;
    if (colours.options.length !== offered.length || colours.options[2]?.value !== offered[2]?.[0]) {
      colours.replaceChildren(...offered.map(([value, textContent]) => make("option", { value, textContent })));
    }
    colours.value = stage.colour;
    this.chosen.forEach(([select, chosen]) => (chosen.textContent = select.selectedOptions[0]?.textContent ?? ""));
    this.resized();
  },

  resized() {
    const { stage } = this;
    this.names.hidden = !stage.beside && !stage.truthShown;
    const short = ({ title }) => title.replace(/ \([^()]*=[^()]*\)$/, ""); // without settings, not to cover the organ
    this.labels[0].textContent = stage.truthShown ? "the truth" : short(stage.choice ?? { title: "" });
    this.labels[1].textContent = stage.beside ? short(stage.besides) : "";
    if (!stage.beside) this.besideKey.hidden = true;
    const { clientWidth, clientHeight } = this.canvas;
    this.labels.forEach((label, i) => {
      const [left, top, width, height] = stage.box(i, clientWidth, clientHeight);
      Object.assign(label.style, { left: `${left}px`, bottom: `${clientHeight - top - height}px`, maxWidth: `calc(${width}px - 1.4rem)` });
    });
  },

  warn(sentence) {
    this.doubt.hidden = false;
    this.doubt.textContent = sentence;
  },
});

// this script stands right behind its figure
const figure = document.currentScript.previousElementSibling;
figure.stage = new Stage(figure);
