// Answer presses on a body from a portable model file (docs/portable-model.md): no dependency, in a page or in node.
//   const model = Palpate.load(bytes);    // an ArrayBuffer or a view, such as require("fs").readFileSync(path)
//   model.respond([{triangle, weights: [a, b, c], force: [x, y, z]}]);    // or moved: [x, y, z] in place of force
"use strict";
const Palpate = (() => {
  const VERSION = 1, HEAD = 144, ENOUGH = 1e-6, ITERATIONS = 200, MEMORY = 10, CLOSE = 1e-6, MOST = 40, HELD = 2e-3;
  const MOST_MODES = 256, MOST_CELLS = 4096, MOST_VECTORS = 1024, MOST_PARTS = 8;

  function must(holds, otherwise) {
    if (!holds) throw new Error(otherwise);
  }

  function crc32(bytes, from) {
    const table = new Uint32Array(256);
    for (let i = 0; i < 256; i++) {
      let c = i;
      for (let k = 0; k < 8; k++) c = c & 1 ? (c >>> 1) ^ 0xedb88320 : c >>> 1;
      table[i] = c;
    }
    let crc = 0xffffffff;
    for (let i = from; i < bytes.length; i++) crc = table[(crc ^ bytes[i]) & 255] ^ (crc >>> 8);
    return (crc ^ 0xffffffff) >>> 0;
  }

  function reader(given) {
    must(given instanceof ArrayBuffer || ArrayBuffer.isView(given), "a model is read from the bytes of its file");
    // a view, such as node's, may begin anywhere in its buffer
    const buffer = given instanceof ArrayBuffer ? given : given.buffer.slice(given.byteOffset, given.byteOffset + given.byteLength);
    const bytes = new Uint8Array(buffer), view = new DataView(buffer);
    let magic = "";
    for (let i = 0; i < Math.min(8, bytes.length); i++) magic += String.fromCharCode(bytes[i]);
    must(bytes.length >= HEAD && magic === "palpate\n", "this is no portable model of palpate");
    const word = (at) => view.getUint32(at, true);
    must(word(8) === VERSION, `this is a portable model of version ${word(8)}, and version ${VERSION} is read here`);
    must(word(12) === bytes.length, `the file has ${bytes.length} bytes instead of ${word(12)}; it was cut off, or more was added`);
    must(word(16) === crc32(bytes, 20), "the checksum is wrong; the file is damaged");
    const words = word(20), counts = [24, 28, 32, 36, 40, 44].map(word), total = bytes.length;
    const [n, t, stored, vectors, contacts, parts] = counts;
    const sound = n > 0 && n <= total && t > 0 && t <= total && stored > 0 && stored <= n && contacts > 0 && contacts <= total;
    must(sound && vectors > 0 && vectors <= MOST_VECTORS && parts > 0 && parts <= MOST_PARTS, "its sizes are not those of a model");
    const scalars = [];
    for (let i = 0; i < 12; i++) scalars.push(view.getFloat64(48 + 8 * i, true));
    must(scalars.every((each) => Number.isFinite(each) && each >= 0), "a number of the header is not finite");
    must(scalars[0] > 0, "the radius is not above 0");
    must(words % 4 === 0 && HEAD + words <= total, "its header is longer than the file");
    let info = null;
    try {
      info = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(bytes.subarray(HEAD, HEAD + words)));
    } catch (error) {
      info = null;
    }
    must(info !== null && typeof info === "object" && !Array.isArray(info), "its header is not JSON");
    let at = HEAD + words;
    const little = new Uint8Array(new Uint32Array([1]).buffer)[0] === 1;
    must(little, "this machine stores numbers the other way round");
    const take = (Kind, count) => {
      const size = Kind.BYTES_PER_ELEMENT * count;
      must(at + size <= total, "an array is longer than the file");
      const found = new Kind(buffer, at, count);
      at += size + ((4 - (size % 4)) % 4);
      return found;
    };
    const floats = (count) => {
      const found = take(Float32Array, count);
      for (let i = 0; i < count; i++) must(Number.isFinite(found[i]), "a number is not finite");
      return found;
    };
    return { info, counts, scalars, take, floats, end: () => must(at === total, "something follows its last array") };
  }

  // the middles of the triangles that a triangle is split into, as weights of its corners
  function splitTriangle(count) {
    const found = [];
    const add = (i, j, k) => {
      const a = (3 * i + k) / (3 * count), b = (3 * j + k) / (3 * count);
      found.push(a, b, 1 - a - b);
    };
    for (let i = 0; i < count; i++)
      for (let j = 0; j < count - i; j++) {
        add(i, j, 1);
        if (i + j < count - 1) add(i, j, 2);
      }
    return Float64Array.from(found);
  }

  class Model {
    constructor(buffer) {
      const read = reader(buffer), s = read.scalars;
      [this.n, this.t, this.stored, this.vectors] = read.counts;
      const { n, t, stored, vectors } = this;
      this.info = read.info;
      [this.radius, this.guard, this.far, this.hard, this.farthest, this.floor, this.share, this.spread, this.several] = s;
      this.held = s[10] > 0 ? (HELD * s[9]) / s[10] : 0;
      this.nodes = read.floats(3 * n);
      this.normals = read.floats(3 * n);
      this.triangles = read.take(Uint32Array, 3 * t);
      for (let i = 0; i < 3 * t; i++) must(this.triangles[i] < n, "a triangle has a node that is not there");
      this.from = read.take(Uint32Array, 6 * n);
      this.by = read.floats(6 * n);
      for (let i = 0; i < 6 * n; i++) must(this.from[i] < stored, "a node is made of one that is not there");
      const scale = read.floats(vectors), packed = read.take(Int16Array, 3 * stored * vectors);
      this.basis = new Float32Array(3 * stored * vectors);
      for (let v = 0, i = 0; v < vectors; v++) for (let j = 0; j < 3 * stored; j++, i++) this.basis[i] = packed[i] * scale[v];
      this.compliance = read.floats(vectors * vectors);
      this.shapes = splitTriangle(read.counts[5]);
      this.frame();
      this.contacts = [];
      for (let i = 0; i < read.counts[4]; i++) this.contacts.push(this.contact(read));
      read.end();
      this.moved = new Float32Array(3 * stored);
      this.apart = new Float64Array(this.contacts.length);
    }

    // areas, normals and middles of the triangles
    frame() {
      const { t, triangles, nodes } = this;
      this.areas = new Float64Array(t);
      this.facing = new Float64Array(3 * t);
      this.middles = new Float64Array(3 * t);
      this.wide = 0;
      for (let e = 0; e < t; e++) {
        const [a, b, c] = [0, 1, 2].map((k) => 3 * triangles[3 * e + k]);
        const p = [], q = [];
        for (let d = 0; d < 3; d++) {
          p.push(nodes[b + d] - nodes[a + d]);
          q.push(nodes[c + d] - nodes[a + d]);
          this.middles[3 * e + d] = (nodes[a + d] + nodes[b + d] + nodes[c + d]) / 3;
        }
        const area = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
        this.areas[e] = Math.hypot(...area);
        for (let d = 0; d < 3; d++) this.facing[3 * e + d] = area[d] / Math.max(this.areas[e], 1e-300);
        for (const corner of [a, b, c]) {
          let square = 0;
          for (let d = 0; d < 3; d++) square += (nodes[corner + d] - this.middles[3 * e + d]) ** 2;
          this.wide = Math.max(this.wide, Math.sqrt(square));
        }
      }
      this.weights = new Float64Array(this.stored);
    }

    contact(read) {
      const [r, m] = read.take(Uint32Array, 2), { vectors } = this;
      must(r > 0 && r <= MOST_MODES && m <= MOST_CELLS, "a contact has too many coordinates or cells");
      const places = read.floats(9), reach = read.floats(1)[0];
      must(reach > 0, "a contact reaches nowhere");
      const one = { r, m, reach, place: places.subarray(0, 3), normal: places.subarray(3, 6), bearing: places.subarray(6, 9) };
      one.loads = read.floats(3 * r);
      one.rest = Float64Array.from(read.floats(r * r));
      one.volumes = read.floats(m);
      one.mu = read.floats(m);
      one.lam = read.floats(m);
      let scale = read.floats(r), packed = read.take(Int16Array, 9 * m * r);
      one.slopes = new Float64Array(9 * m * r);
      for (let i = 0; i < packed.length; i++) one.slopes[i] = packed[i] * scale[i % r];
      scale = read.floats(r);
      packed = read.take(Int16Array, r * vectors);
      one.coefficients = new Float64Array(r * vectors);
      for (let i = 0; i < packed.length; i++) one.coefficients[i] = packed[i] * scale[Math.floor(i / vectors)];
      one.noise = 0;
      for (let i = 0; i < m; i++) one.noise += 4e-15 * one.volumes[i] * (one.mu[i] + one.lam[i]);
      one.here = this.disc(one.place, one.normal);
      one.f = new Float64Array(9 * m);
      return one;
    }

    // the mean of the vectors over the disc around a point, (3, vectors), weighted by its pressure
    disc(point, normal) {
      const { radius, stored, vectors, basis, weights, shapes, nodes, triangles } = this;
      const square = radius * radius, near = (radius + this.wide) ** 2, x = new Float64Array(9);
      weights.fill(0);
      let total = 0;
      for (let e = 0; e < this.t; e++) {
        let apart = 0, cosine = 0;
        for (let d = 0; d < 3; d++) {
          apart += (this.middles[3 * e + d] - point[d]) ** 2;
          cosine += this.facing[3 * e + d] * normal[d];
        }
        if (apart >= near || cosine <= 0) continue;
        const weight = Math.min(cosine / 0.1, 1) * this.areas[e];
        for (let k = 0; k < 3; k++) for (let d = 0; d < 3; d++) x[3 * k + d] = nodes[3 * triangles[3 * e + k] + d] - point[d];
        let one = 0, two = 0, three = 0;
        for (let i = 0; i < shapes.length; i += 3) {
          const a = shapes[i], b = shapes[i + 1], c = shapes[i + 2];
          const u = a * x[0] + b * x[3] + c * x[6], v = a * x[1] + b * x[4] + c * x[7], w = a * x[2] + b * x[5] + c * x[8];
          const part = 1 - (u * u + v * v + w * w) / square;
          if (part <= 0) continue;
          one += a * part;
          two += b * part;
          three += c * part;
        }
        this.add(triangles[3 * e], weight * one);
        this.add(triangles[3 * e + 1], weight * two);
        this.add(triangles[3 * e + 2], weight * three);
        total += weight * (one + two + three);
      }
      if (!(total > 0)) {
        let best = 0, least = Infinity;
        for (let i = 0; i < this.n; i++) {
          let apart = 0;
          for (let d = 0; d < 3; d++) apart += (nodes[3 * i + d] - point[d]) ** 2;
          if (apart < least) [best, least] = [i, apart];
        }
        weights.fill(0);
        this.add(best, 1);
        total = 1;
      }
      const touched = [];
      for (let i = 0; i < stored; i++) if (weights[i] !== 0) touched.push(i);
      const found = new Float64Array(3 * vectors);
      for (let v = 0; v < vectors; v++) {
        const begin = 3 * stored * v;
        let a = 0, b = 0, c = 0;
        for (let i = 0; i < touched.length; i++) {
          const at = begin + 3 * touched[i], weight = weights[touched[i]];
          a += weight * basis[at];
          b += weight * basis[at + 1];
          c += weight * basis[at + 2];
        }
        found[v] = a / total;
        found[vectors + v] = b / total;
        found[2 * vectors + v] = c / total;
      }
      return found;
    }

    add(node, weight) {
      for (let i = 6 * node; i < 6 * node + 6; i++) if (this.by[i] !== 0) this.weights[this.from[i]] += weight * this.by[i];
    }

    place(press) {
      const { triangle } = press, { vectors } = this, weights = numbers(press, "weights");
      must(Number.isInteger(triangle) && triangle >= 0 && triangle < this.t, `the press is on triangle ${triangle}, which is not there`);
      const sum = weights[0] + weights[1] + weights[2];
      must(Math.min(...weights) >= -1e-6 && Math.abs(sum - 1) < 1e-4, "the weights of a press are not of a point in its triangle");
      const point = [0, 0, 0], normal = [0, 0, 0];
      for (let k = 0; k < 3; k++)
        for (let d = 0; d < 3; d++) {
          point[d] += weights[k] * this.nodes[3 * this.triangles[3 * triangle + k] + d];
          normal[d] += weights[k] * this.normals[3 * this.triangles[3 * triangle + k] + d];
        }
      const length = Math.max(Math.hypot(...normal), 1e-30);
      for (let d = 0; d < 3; d++) normal[d] /= length;
      const disc = this.disc(point, normal), { apart } = this;
      for (let i = 0; i < apart.length; i++) {
        const one = this.contacts[i];
        let square = 0;
        for (let d = 0; d < 3; d++)
          square += (one.place[d] - point[d]) ** 2 + this.radius * this.radius * (one.normal[d] - normal[d]) ** 2;
        apart[i] = Math.sqrt(square);
      }
      const order = [];
      for (let k = 0; k < Math.min(4, apart.length); k++) {
        let best = -1;
        for (let i = 0; i < apart.length; i++) if (!order.includes(i) && (best < 0 || apart[i] < apart[best])) best = i;
        order.push(best);
      }
      const edge = order.length > 3 ? Math.max(apart[order[3]], 1e-9) : Infinity;
      let shares = order.slice(0, 3).map((i) => {
        const d = Math.max(apart[i], 1e-9);
        return Math.max(0, 1 - d / edge) ** 2 / (d * d);
      });
      let total = shares.reduce((a, b) => a + b, 0);
      if (!(total > 0)) [shares, total] = [[1, 0, 0], 1];
      let near = [];
      for (let k = 0; k < Math.min(3, order.length); k++) {
        if (!(shares[k] > 1e-3 * total)) continue;
        const one = this.contacts[order[k]], loads = Float64Array.from(one.loads);
        for (let i = 0; i < one.r; i++)
          for (let d = 0; d < 3; d++) {
            let more = 0;
            for (let v = 0; v < vectors; v++) more += (disc[d * vectors + v] - one.here[d * vectors + v]) * one.coefficients[i * vectors + v];
            loads[3 * i + d] += more;
          }
        near.push({ one, weight: shares[k], loads, q: null });
      }
      total = near.reduce((sum, each) => sum + each.weight, 0);
      for (const each of near) each.weight /= total;
      return { disc, near, normal, apart: apart[order[0]] };
    }

    // what a press has beyond its linear part
    bent(place, force, warm) {
      const { vectors } = this, more = new Float64Array(vectors), parts = [];
      let least = Infinity, far = 0, left = 0, spread = 0;
      for (const each of place.near) {
        const { one, loads } = each, load = new Float64Array(one.r), part = new Float64Array(vectors);
        for (let i = 0; i < one.r; i++) load[i] = loads[3 * i] * force[0] + loads[3 * i + 1] * force[1] + loads[3 * i + 2] * force[2];
        const found = settle(one, load, warm ? each.q : null);
        if (warm) each.q = found.q;
        let size = 0;
        for (let i = 0; i < one.r; i++) {
          const by = found.q[i] - load[i];
          size += found.q[i] * found.q[i];
          for (let v = 0; v < vectors; v++) part[v] += by * one.coefficients[i * vectors + v];
        }
        for (let v = 0; v < vectors; v++) more[v] += each.weight * part[v];
        parts.push(part);
        least = Math.min(least, found.least);
        left = Math.max(left, found.left);
        far = Math.max(far, Math.sqrt(size) / one.reach);
      }
      let size = 0;
      for (let v = 0; v < vectors; v++) {
        size += more[v] * more[v];
        for (let k = 0; k < parts.length; k++) spread += place.near[k].weight * (parts[k][v] - more[v]) ** 2;
      }
      return { more, size: Math.sqrt(size), spread: Math.sqrt(spread), least, far, left };
    }

    // coordinates of the linear part of all presses in the vectors
    linear(places, forces) {
      const { vectors, compliance } = this, loaded = new Float64Array(vectors), sum = new Float64Array(vectors);
      places.forEach((place, k) => {
        for (let d = 0; d < 3; d++) for (let v = 0; v < vectors; v++) loaded[v] += forces[3 * k + d] * place.disc[d * vectors + v];
      });
      for (let i = 0; i < vectors; i++) {
        let one = 0;
        for (let j = 0; j < vectors; j++) one += compliance[i * vectors + j] * loaded[j];
        sum[i] = one;
      }
      return sum;
    }

    // how far [m] a place is moved straight in by as hard a force as it is known to bear, if responses are linear
    depth(press) {
      const { vectors } = this, place = this.place(press), axes = [0, 1, 2];
      const row = (d) => place.disc.subarray(d * vectors, (d + 1) * vectors);
      const moved = axes.map((d) => this.linear([place], Float64Array.from(axes, (each) => (each === d ? 1 : 0))));
      const inverse = inverted(axes.map((e) => axes.map((d) => dot(row(e), moved[d]))), this.held);
      const metre = Math.hypot(...inverse.map((each) => inner(each, place.normal)));
      const hardest = place.near.reduce((sum, { one, weight }) => sum + weight / Math.hypot(...one.bearing), 0);
      return metre > 0 ? hardest / metre : 0;
    }

    // coordinates of all presses in the vectors
    all(places, forces, warm) {
      const { vectors } = this, sum = this.linear(places, forces);
      const bent = places.map((place, k) => this.bent(place, forces.subarray(3 * k, 3 * k + 3), warm));
      for (const each of bent) for (let v = 0; v < vectors; v++) sum[v] += each.more[v];
      return { sum, bent };
    }

    respond(presses, out) {
      const begin = now(), k = presses.length, places = presses.map((press) => this.place(press));
      let forces = new Float64Array(3 * k), missed = false;
      const moves = presses.map((press) => press.moved !== undefined && press.moved !== null);
      presses.forEach((press, i) => forces.set(numbers(press, moves[i] ? "moved" : "force"), 3 * i));
      if (moves.some(Boolean)) [forces, missed] = this.found(places, forces, moves);
      const { sum, bent } = this.all(places, forces, false);
      const displacement = out instanceof Float32Array && out.length === 3 * this.n ? out : new Float32Array(3 * this.n);
      let peak = Math.max(this.expand(sum, displacement), 1e-30);
      if (!Number.isFinite(peak) || !forces.every(Number.isFinite)) {
        displacement.fill(0);
        const doubt = "the numbers of this answer are beyond what can be stored";
        return { displacement, forces: new Float32Array(3 * k), error: 1, doubt, ms: now() - begin };
      }
      let error = this.floor, sizes = 0, most = 0;
      for (const each of bent) {
        error += (this.share * each.size + this.spread * each.spread) / peak;
        sizes += each.size;
        most = Math.max(most, each.size);
      }
      error = missed ? 1 : Math.min(error + (this.several * (sizes - most)) / peak, 1);
      let doubt = missed ? "no force was found that moves the disc as far as it is pushed" : "";
      places.forEach((place, i) => (doubt = doubt || this.doubt(place, bent[i], forces.subarray(3 * i, 3 * i + 3))));
      return { displacement, forces: Float32Array.from(forces), error, doubt, ms: now() - begin };
    }

    // bring coordinates to all nodes; return the largest displacement, NaN if a number is not finite
    expand(sum, out) {
      const { n, stored, vectors, basis, moved, from, by } = this, size = 3 * stored;
      moved.fill(0);
      let v = 0;
      for (; v + 3 < vectors; v += 4) {
        const a = sum[v], b = sum[v + 1], c = sum[v + 2], d = sum[v + 3];
        const i0 = v * size, i1 = i0 + size, i2 = i1 + size, i3 = i2 + size;
        for (let i = 0; i < size; i++) moved[i] += a * basis[i0 + i] + b * basis[i1 + i] + c * basis[i2 + i] + d * basis[i3 + i];
      }
      for (; v < vectors; v++) for (let i = 0; i < size; i++) moved[i] += sum[v] * basis[v * size + i];
      let most = 0;
      for (let i = 0; i < n; i++) {
        let x = 0, y = 0, z = 0;
        for (let j = 6 * i; j < 6 * i + 6; j++) {
          const weight = by[j], at = 3 * from[j];
          if (weight === 0) continue;
          x += weight * moved[at];
          y += weight * moved[at + 1];
          z += weight * moved[at + 2];
        }
        out[3 * i] = x;
        out[3 * i + 1] = y;
        out[3 * i + 2] = z;
        const square = x * x + y * y + z * z;
        if (!(square <= most)) most = square;
      }
      return Number.isFinite(most) && out.every(Number.isFinite) ? Math.sqrt(most) : NaN;
    }

    doubt(place, bent, force) {
      let hard = 0;
      for (const { one, weight } of place.near)
        for (let d = 0; d < 3; d++) hard += weight * one.bearing[d] * force[d];
      if (!(bent.left <= 1e-3)) return `the model found no rest: ${(100 * bent.left).toFixed(1)} % of the load are left`;
      if (!(bent.least >= this.guard)) return `cells are squeezed to det F = ${bent.least.toFixed(2)}, beyond what the contact's model was made for`;
      if (!(bent.far <= this.far)) return `this goes ${bent.far.toFixed(1)} times as far as what the contact's model is made of`;
      if (!(hard <= this.hard)) return `this presses ${hard.toFixed(2)} times as hard as finer elements are known to bear`;
      if (!(place.apart <= this.farthest)) return `the nearest place that was prepared is ${(1e3 * place.apart).toFixed(0)} mm away`;
      return "";
    }

    // the forces of all presses, those of moved discs found by Broyden's method, and whether they were not
    found(places, given, moves) {
      const { vectors, compliance } = this, free = [];
      moves.forEach((moved, i) => moved && free.push(3 * i, 3 * i + 1, 3 * i + 2));
      const size = free.length, row = (i) => places[Math.floor(i / 3)].disc.subarray((i % 3) * vectors, (i % 3 + 1) * vectors);
      let force = given.slice();
      for (const i of free) force[i] = 0;
      const left_of = (tried) => {
        const { sum } = this.all(places, tried, true);
        return free.map((i) => given[i] - dot(row(i), sum));
      };
      const slope = free.map((i) => {
        const part = new Float64Array(vectors), mine = row(i);
        for (let a = 0; a < vectors; a++) for (let b = 0; b < vectors; b++) part[b] += mine[a] * compliance[a * vectors + b];
        return free.map((j) => dot(part, row(j)));
      });
      const inverse = inverted(slope, this.held), times = (x) => inverse.map((each) => inner(each, x));
      const most = (x) => Math.max(...x.map(Math.abs));
      let left = left_of(force), step = times(left);
      const scale = Math.max(most(left), ...free.map((i) => Math.abs(given[i]))); // a held disc has a way to go, too
      for (let turn = 0; turn < MOST; turn++) {
        if (most(left) <= CLOSE * scale) return [force, false];
        const tried = force.slice();
        free.forEach((i, k) => (tried[i] += step[k]));
        const now_left = left_of(tried);
        if (!(Math.hypot(...now_left) < 1.5 * Math.hypot(...left))) {
          step = step.map((each) => 0.5 * each);
          continue;
        }
        const change = times(left.map((each, i) => each - now_left[i])), below = inner(step, change);
        if (below !== 0) {
          const by = new Float64Array(size);
          for (let i = 0; i < size; i++) for (let j = 0; j < size; j++) by[j] += step[i] * inverse[i][j];
          for (let i = 0; i < size; i++) for (let j = 0; j < size; j++) inverse[i][j] += ((step[i] - change[i]) * by[j]) / below;
        }
        force = tried;
        left = now_left;
        step = times(left);
      }
      return [force, most(left) > 1e-3 * scale];
    }
  }

  const now = () => (typeof performance === "undefined" ? Date.now() : performance.now());

  function numbers(press, name) {
    const found = press === null || typeof press !== "object" ? null : press[name];
    const sound = found && found.length === 3 && [0, 1, 2].every((i) => typeof found[i] === "number" && Number.isFinite(found[i]));
    must(sound, `a press needs three finite numbers as its ${name}`);
    return [found[0], found[1], found[2]];
  }

  // the product of two plain lists; dot has typed ones only, which keeps it fast
  function inner(a, b) {
    return a.reduce((sum, each, i) => sum + each * b[i], 0);
  }

  function dot(a, b) {
    let sum = 0;
    for (let i = 0; i < a.length; i++) sum += a[i] * b[i];
    return sum;
  }

  // Gauss and Jordan, with pivots; rows that have none become zero
  function inverted(matrix, least) {
    const size = matrix.length, work = matrix.map((row, i) => [...row, ...row.map((_, j) => (i === j ? 1 : 0))]);
    for (let k = 0; k < size; k++) {
      let best = k;
      for (let i = k + 1; i < size; i++) if (Math.abs(work[i][k]) > Math.abs(work[best][k])) best = i;
      [work[k], work[best]] = [work[best], work[k]];
      const pivot = work[k][k];
      if (!(Math.abs(pivot) > least && Number.isFinite(pivot))) return matrix.map((row) => row.map(() => 0));
      for (let j = 0; j < 2 * size; j++) work[k][j] /= pivot;
      for (let i = 0; i < size; i++) {
        const by = work[i][k];
        if (i !== k) for (let j = 0; j < 2 * size; j++) work[i][j] -= by * work[k][j];
      }
    }
    return work.map((row) => row.slice(size));
  }

  // minimise the energy of a contact's cells less the work of the load, by L-BFGS that starts from the identity
  function settle(one, load, start) {
    const { r } = one, size = Math.sqrt(dot(load, load)), pairs = [];
    let q = start ? start : load.slice(), gradient = new Float64Array(r), bent = new Float64Array(r);
    let [energy, least] = evaluate(one, load, q, gradient);
    for (let turn = 0; turn < ITERATIONS; turn++) {
      if (Math.sqrt(dot(gradient, gradient)) <= ENOUGH * size) break;
      const ahead = gradient.map((each) => -each), parts = [];
      for (let k = pairs.length - 1; k >= 0; k--) {
        const [step, bend, scale] = pairs[k];
        parts[k] = scale * dot(step, ahead);
        for (let i = 0; i < r; i++) ahead[i] -= parts[k] * bend[i];
      }
      for (let k = 0; k < pairs.length; k++) {
        const [step, bend, scale] = pairs[k], by = parts[k] - scale * dot(bend, ahead);
        for (let i = 0; i < r; i++) ahead[i] += by * step[i];
      }
      const slope = -dot(gradient, ahead);
      let length = 1, lower = 0, smallest = 0, found = false, reached = q;
      while (slope > 0 && length > 1e-4) {
        reached = new Float64Array(r);
        for (let i = 0; i < r; i++) reached[i] = q[i] + length * ahead[i];
        [lower, smallest] = evaluate(one, load, reached, bent);
        if (lower <= energy - 1e-4 * length * slope + 1e-12 * Math.abs(energy) + one.noise) {
          found = true;
          break;
        }
        length *= 0.5;
      }
      if (!found) {
        if (!pairs.length) break;
        pairs.length = 0;
        continue;
      }
      const step = new Float64Array(r), bend = new Float64Array(r);
      for (let i = 0; i < r; i++) {
        step[i] = reached[i] - q[i];
        bend[i] = bent[i] - gradient[i];
      }
      const curvature = dot(step, bend);
      if (curvature > 0) {
        if (pairs.length === MEMORY) pairs.shift();
        pairs.push([step, bend, 1 / curvature]);
      }
      q = reached;
      [gradient, bent] = [bent, gradient];
      [energy, least] = [lower, smallest];
    }
    return { q, least, left: Math.sqrt(dot(gradient, gradient)) / Math.max(size, 1e-300) };
  }

  // energy and smallest det F; the gradient is written. s = tr RᵀF is the largest root of (s² − I)² = 4 II + 8 J s
  function evaluate(one, load, q, gradient) {
    const { r, m, slopes, f, rest } = one;
    let energy = 0, least = Infinity;
    for (let i = 0, at = 0; i < 9 * m; i++) {
      let sum = 0;
      for (let k = 0; k < r; k++, at++) sum += slopes[at] * q[k];
      f[i] = sum;
    }
    for (let k = 0; k < m; k++) {
      const a = f[k] + 1, b = f[m + k], c = f[2 * m + k], d = f[3 * m + k], e = f[4 * m + k] + 1, g = f[5 * m + k];
      const h = f[6 * m + k], i = f[7 * m + k], j = f[8 * m + k] + 1;
      const C0 = e * j - g * i, C1 = g * h - d * j, C2 = d * i - e * h, C3 = c * i - b * j, C4 = a * j - c * h;
      const C5 = b * h - a * i, C6 = b * g - c * e, C7 = c * d - a * g, C8 = a * e - b * d, det = a * C0 + b * C1 + c * C2;
      const p = a * a + d * d + h * h, u = b * b + e * e + i * i, w = c * c + g * g + j * j, first = p + u + w;
      const x = a * b + d * e + h * i, y = a * c + d * g + h * j, z = b * c + e * g + i * j;
      const second = C0 * C0 + C1 * C1 + C2 * C2 + C3 * C3 + C4 * C4 + C5 * C5 + C6 * C6 + C7 * C7 + C8 * C8;
      let s = Math.sqrt(3 * first);
      for (let turn = 0; turn < 30; turn++) {
        const off = s * s - first;
        const change = (off * off - 4 * second - 8 * det * s) / Math.max(4 * s * off - 8 * det, 1e-12);
        s -= change;
        if (!(Math.abs(change) > 1e-13 * s)) break;
      }
      const off = s * s - first, mu = one.mu[k], lam = one.lam[k], volume = one.volumes[k];
      energy += volume * (mu * (first - 2 * s + 3) + 0.5 * lam * (s - 3) * (s - 3));
      const bottom = Math.max(s * off - 2 * det, 1e-12), turned = (lam * (s - 3) - 2 * mu) * volume / bottom;
      const own = 2 * mu * volume + turned * (off + 2 * first), back = -2 * turned, side = 2 * s * turned;
      f[k] = own * a + back * (a * p + b * x + c * y) + side * C0;
      f[m + k] = own * b + back * (a * x + b * u + c * z) + side * C1;
      f[2 * m + k] = own * c + back * (a * y + b * z + c * w) + side * C2;
      f[3 * m + k] = own * d + back * (d * p + e * x + g * y) + side * C3;
      f[4 * m + k] = own * e + back * (d * x + e * u + g * z) + side * C4;
      f[5 * m + k] = own * g + back * (d * y + e * z + g * w) + side * C5;
      f[6 * m + k] = own * h + back * (h * p + i * x + j * y) + side * C6;
      f[7 * m + k] = own * i + back * (h * x + i * u + j * z) + side * C7;
      f[8 * m + k] = own * j + back * (h * y + i * z + j * w) + side * C8;
      if (!(det >= least)) least = det;
    }
    for (let i = 0; i < r; i++) {
      let pull = 0;
      for (let k = 0; k < r; k++) pull += rest[i * r + k] * q[k];
      energy += q[i] * (0.5 * pull - load[i]);
      gradient[i] = pull - load[i];
    }
    for (let i = 0, at = 0; i < 9 * m; i++) {
      const by = f[i];
      for (let k = 0; k < r; k++, at++) gradient[k] += by * slopes[at];
    }
    return [energy, least];
  }

  return { load: (buffer) => new Model(buffer), VERSION };
})();
if (typeof module !== "undefined") module.exports = Palpate;
