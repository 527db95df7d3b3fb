// What stands around the view: readings, choices, the key of colours, and the sentence that is read aloud.
const WAYS = { press: "Press", slide: "Slide", tilt: "Tilt", turn: "Turn" };
const KNIFE_WAYS = { pull: "Pull", cut: "Cut" }; // where a model follows a knife
const KEYS = [
  ["1 2 3 …", "what a drag or an arrow key does"], ["Enter", "press at the mark, or let go"],
  ["arrows", "move the mark; then deeper, along, aslant, or the view"], ["+ − 0", "nearer, farther, as at first"],
  ["P", "pin this finger; the next press is a second one"], ["T", "show the truth, where one is loaded"], ["Esc", "let go"],
];
const READINGS = { force: "force", gone: "depth", answer: "time of an answer", error: "error of this answer" };
const LEAST = 1e-4, DECADES = [0.001, 0.01, 0.1]; // where the error bar begins, and its marks; it ends at 1
const AGAIN_MS = 700; // so long nothing may change before the sentence is read aloud

// Three digits of a number, and a unit.
const said = (value, unit) => (Number.isFinite(value) ? `${+value.toPrecision(3)} ${unit}` : "–");
const percent = (share) => said(100 * share, "%");
// Where an error lies on its bar, which is logarithmic.
const along = (error) => `${100 * (1 - clamp(Math.log10(error) / Math.log10(LEAST), 0, 1))}%`;

class Panel {
  constructor(stage) {
    Object.assign(this, { stage, chosen: [] });
    this.build();
    stage.figure.prepend(this.whole);
  }

  build() {
    const { stage } = this, id = (stage.figure.id ||= "press_it");
    this.canvas = make("canvas", { tabIndex: 0 });
    this.canvas.setAttribute("role", "application");
    this.canvas.setAttribute("aria-label", "The organ. Enter presses at the mark, arrow keys move it; all keys are listed below.");
    this.canvas.setAttribute("aria-describedby", `${id}_keys`);
    this.doubt = make("p", { className: "doubt", hidden: true });
    this.labels = [make("span"), make("span")];
    this.names = make("div", { className: "names", hidden: true }, ...this.labels);
    this.key = make("div", { className: "legend" });
    this.besideKey = make("div", { className: "legend" });
    const keys = make("div", { className: "keys" }, this.key, this.besideKey);
    const view = make("div", { className: "view" }, this.canvas, this.names);
    this.live = make("p", { className: "aloud" });
    this.live.setAttribute("aria-live", "polite");
    const list = make("dl", { id: `${id}_keys` }, ...KEYS.flatMap(([key, text]) => [make("dt", { textContent: key }), make("dd", { textContent: text })]));
    const help = make("details", {}, make("summary", { textContent: "Keys" }), list);
    const side = make("div", { className: "side" }, this.readings(), this.tools(), this.ways(), this.sliders(), this.knife(), this.fingers(), this.selects(), this.truths(), help);
    this.whole = make("div", { className: "press-stage" }, make("div", { className: "seen" }, view, keys, this.doubt), side, this.live);
  }

  readings() {
    const reading = ([name, text]) => {
      this[name] = make("b", { textContent: "–" });
      return make("div", {}, make("span", { textContent: text }), this[name]);
    };
    this.bar = make("i");
    this.trueBar = make("i", { className: "true", hidden: true });
    this.bound = make("p", { className: "bound" });
    const decades = DECADES.map((error) => make("span", { textContent: percent(error), style: `left: ${along(error)}` }));
    this.scale = make("div", { className: "errorscale" }, make("div", { className: "errorbar" }, this.bar, this.trueBar), ...decades);
    this.scale.setAttribute("role", "img");
    return make("div", { className: "readings" }, ...Object.entries(READINGS).map(reading), this.scale, this.bound);
  }

  // one of several buttons that stay down, as radio buttons do
  ways() {
    const name = `${this.stage.figure.id}_way`;
    const ways = this.stage.knives().length ? { ...WAYS, ...KNIFE_WAYS } : WAYS;
    this.radios = Object.fromEntries(Object.entries(ways).map(([way, text]) => {
      const radio = make("input", { type: "radio", name, value: way, checked: way === "press" });
      radio.addEventListener("change", () => this.stage.choose(way));
      return [way, [radio, make("label", {}, radio, make("span", { textContent: text }))]];
    }));
    return make("fieldset", { className: "ways" }, make("legend", { textContent: "A drag on the organ does" }),
      ...Object.values(this.radios).map(([, label]) => label));
  }

  slider(text, most, act) {
    const input = make("input", { type: "range", min: 0, max: most, step: "any", value: 0 }), value = make("output");
    input.addEventListener("input", () => act(Number(input.value)));
    return [input, value, make("label", { className: "slider" }, make("span", { textContent: text }), input, value)];
  }

  sliders() {
    const tilt = () => {
      if (!this.stage.active) return;
      this.stage.changed();
      this.stage.active.angles = [Number(this.angle[0].value), Number(this.turned[0].value)];
      this.stage.refresh();
    };
    this.deep = this.slider("depth", 1, (value) => {
      if (this.stage.active) this.stage.deepen(value - this.stage.active.depth);
      else this.stage.depth = value;
      this.tell();
    });
    this.angle = this.slider("tilt", 60, tilt);
    this.turned = this.slider("side", 360, tilt);
    return make("div", { className: "sliders" }, this.deep[2], this.angle[2], this.turned[2]);
  }

  fingers() {
    const button = (textContent, act) => {
      const made = make("button", { type: "button", textContent });
      made.addEventListener("click", act);
      return made;
    };
    this.pin = button("Pin this finger", () => this.stage.pin());
    this.let = button("Let go", () => this.stage.release());
    return make("div", { className: "controls" }, this.pin, this.let);
  }

  // one of a list; over the box lies its choice in as many lines as it needs, as browsers cut names off
  select(text, options, act) {
    const made = make("select", {}, ...options.map(([value, words]) => make("option", { value, textContent: words })));
    const chosen = make("span", { className: "chosen" });
    chosen.setAttribute("aria-hidden", true);
    made.addEventListener("change", () => {
      act(made.value);
      this.choose();
    });
    this.chosen.push([made, chosen]);
    return [made, make("label", {}, make("span", { textContent: text }), make("span", { className: "choice" }, made, chosen))];
  }

  selects() {
    const { stage } = this, { choices } = stage, select = (...given) => this.select(...given);
    const titles = choices.map(({ name, title }) => [name, title]), by = (name) => choices.find((each) => each.name === name);
    this.model = select("model", titles, (name) => stage.take(by(name)));
    this.second = select("beside it", [["", "nothing"], ...titles], (name) => stage.compare(by(name) ?? null));
    this.colours = select("colour", [["displacement", "displacement"], ["error", "displacement over its error"]], (kind) => stage.shadeBy(kind));
    this.advice = make("p", { className: "advice" });
    if (choices.length < 2) this.second[1].hidden = true;
    return make("div", { className: "selects" }, this.model[1], this.advice, this.second[1], this.colours[1]);
  }

  truths() {
    this.samples = this.select("known truth", [], (number) => {
      const truth = this.stage.choice.truths[number];
      if (truth) this.stage.recall(truth);
    });
    this.reveal = make("button", { type: "button", textContent: "Show the truth" });
    this.reveal.addEventListener("click", () => this.stage.showTruth(!this.stage.truthShown));
    this.truthNote = make("p", { className: "advice" });
    this.known = make("div", { className: "selects" }, this.samples[1], make("div", { className: "controls" }, this.reveal), this.truthNote);
    return this.known;
  }
}
