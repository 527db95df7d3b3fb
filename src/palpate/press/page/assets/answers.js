// Who answers: a model whose file lies in the page, or one that a server of this machine asks.
const bytesOf = (text) => {
  const letters = atob(text), bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i++) bytes[i] = letters.charCodeAt(i);
  return bytes;
};

const make = (tag, more = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), more);
  element.append(...children);
  return element;
};

// A model behind an address: presses are posted there, and what comes back says how long the answer took.
class Remote {
  constructor(head) {
    this.info = head.info;
    this.nodes = new Float32Array(bytesOf(head.nodes).buffer);
    this.triangles = new Uint32Array(bytesOf(head.triangles).buffer);
    Object.assign(this, { url: head.url, cuts: [] });
    if (head.knife) this.cut = (cuts) => this.follow(head.knife, cuts);
    this.whole = this.nodes.length; // as it is in all models of the body
  }

  async post(url, sent) {
    const asked = { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(sent) };
    const reply = await fetch(url, asked).catch(() => {
      throw new Error("the server has ended; start palpate press again");
    });
    if (!reply.ok) throw new Error((await reply.text()).trim() || `the server answered ${reply.status}`);
    return reply.json();
  }

  // Have these cuts, and no others: the surface is another one then. What it took, or nothing if it has them already.
  async follow(url, cuts) {
    if (JSON.stringify(cuts) === JSON.stringify(this.cuts)) return null;
    const { nodes, triangles, held, skin, rims, ms, drawn_ms } = await this.post(url, { cuts });
    this.nodes = new Float32Array(bytesOf(nodes).buffer);
    this.triangles = new Uint32Array(bytesOf(triangles).buffer);
    Object.assign(this, { cuts, cutHeld: bytesOf(held), skin, rims }); // nodes before `skin` are of the skin, others of lips
    return { ms, drawn_ms };
  }

  async respond(presses) {
    const { displacement, forces, error, doubt, ms } = await this.post(this.url, this.cuts.length ? { presses, cuts: this.cuts } : { presses });
    return {
      displacement: new Float32Array(bytesOf(displacement).buffer), forces: Float32Array.from(forces.flat()),
      error: error ?? NaN, doubt, ms,
    };
  }
}

// One choice of the page: its head, and the model itself from when it is first needed.
class Choice {
  constructor(figure, head) {
    Object.assign(this, { head, name: head.name, title: head.title, advice: head.advice });
    this.packed = figure.querySelector(`script[data-model="${head.name}"]`);
  }

  get model() {
    if (!this.loaded) {
      const buffer = this.packed && bytesOf(this.packed.textContent).buffer;
      if (this.head.url) this.loaded = new Remote(this.head);
      else this.loaded = this.head.kind === "coarse" ? new Coarse(buffer, this.head.info) : Palpate.load(buffer);
      this.packed?.remove(); // megabytes of text that nobody reads again
    }
    return this.loaded;
  }

  // truths with their displacements (3 n) [m], which are packed as whole numbers
  get truths() {
    this.unpacked ??= this.head.truths.map((truth) => ({
      ...truth,
      displacement: Float32Array.from(new Int16Array(bytesOf(truth.packed).buffer), (value) => value * truth.step),
    }));
    return this.unpacked;
  }
}

// Root mean square of the lengths of differences over the surface, over the largest length of `truth`.
const rmseOfPeak = (found, truth) => {
  let all = 0, peak = 0;
  for (let i = 0; i < truth.length; i += 3) {
    all += (found[i] - truth[i]) ** 2 + (found[i + 1] - truth[i + 1]) ** 2 + (found[i + 2] - truth[i + 2]) ** 2;
    peak = Math.max(peak, truth[i] ** 2 + truth[i + 1] ** 2 + truth[i + 2] ** 2);
  }
  return Math.sqrt((all * 3) / truth.length / peak);
};

// The length of each node's displacement, or of its difference from another, into `lengths`; the largest is returned.
const fillLengths = (displacement, other, lengths) => {
  let most = 0;
  for (let i = 0, n = 0; n < lengths.length; n++, i += 3) {
    const x = displacement[i] - (other ? other[i] : 0), y = displacement[i + 1] - (other ? other[i + 1] : 0);
    const z = displacement[i + 2] - (other ? other[i + 2] : 0);
    lengths[n] = Math.sqrt(x * x + y * y + z * z);
    if (lengths[n] > most) most = lengths[n];
  }
  return most;
};

// The largest length of the displacements (3 n).
const largest = (displacement) => {
  let most = 0;
  for (let i = 0; i < displacement.length; i += 3) {
    most = Math.max(most, displacement[i] ** 2 + displacement[i + 1] ** 2 + displacement[i + 2] ** 2);
  }
  return Math.sqrt(most);
};
