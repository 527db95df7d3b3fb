// Answer presses on a body from a portable model file (docs/portable-model.md): no dependency, in a page or in node.
//   const model = Palpate.load(bytes);    // an ArrayBuffer or a view, such as require("fs").readFileSync(path)
//   model.respond([{triangle, weights: [a, b, c], force: [x, y, z]}]);    // or moved: [x, y, z] in place of force
//   model.respond(presses, {from: answer});    // begins where an answer to similar presses has ended
//   model.touch({place: 0, depth: 0.003, direction: [0, 0, -1]});    // the rigid instrument of model.touches[0]
"use strict";
const Palpate = (() => {
  const VERSION = 2, HEAD = 144, RESIDUAL_TOLERANCE = 1e-6, ITERATIONS = 200, FIRST_TOLERANCE = 0.1;
  const FORCE_SEARCH_TOLERANCE = 1e-6, MOST_SEARCH_STEPS = 40, HELD_COMPLIANCE = 2e-3;
  const LEAST_EIGENVALUE = 0.03, MOST_MISSED = 0.1, MOST_PRESSES = 16;
  const MOST_MODES = 256, MOST_CELLS = 4096, MOST_VECTORS = 1024, MOST_PARTS = 8;
  const TOUCH_TOLERANCE = 1e-8, TOUCH_ITERATIONS = 60, TOUCH_RESIDUAL = 1e-3, STEEPEST = 45, TILTED = 30, ROUNDING = 1 + 1e-6;
  const MOST_POINTS = 16384, MOST_PUSHES = 256, MOST_PLACES = 1024, FRAME = 12, KINDS = ["sphere", "punch"];
  const WORDS = ["body", "regime", "model", "error"], NUMBERS = ["radius_m", "peak_m", "hardest_n"];

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
    const known = word(8) >= 1 && word(8) <= VERSION;
    must(known, `this is a portable model of version ${word(8)}, and versions 1 to ${VERSION} are read here`);
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
    const places = word(8) > 1 ? scalars[11] : 0;
    must(places <= MOST_PLACES && Number.isInteger(places), "its number of places to touch is none");
    must(words % 4 === 0 && HEAD + words <= total, "its header is longer than the file");
    let info = null;
    try {
      info = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(bytes.subarray(HEAD, HEAD + words)));
    } catch (error) {
      info = null;
    }
    must(info !== null && typeof info === "object" && !Array.isArray(info), "its header is not JSON");
    for (const name of [...WORDS, ...NUMBERS]) {
      const [kind, said] = WORDS.includes(name) ? ["string", "a text"] : ["number", "a number"];
      must(typeof info[name] === kind, `its header lacks ${name}, which is ${said}`);
    }
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
    const doubles = (count) => Float64Array.from(floats(count));
    // whole numbers in rows of so many times the scale of their column, which stands before them
    const columns = (rows, count) => {
      const scale = floats(count), packed = take(Int16Array, rows * count);
      return Float64Array.from(packed, (each, i) => each * scale[i % count]);
    };
    return { info, counts, scalars, places, take, floats, doubles, columns, end: () => must(at === total, "something follows its last array") };
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
      this.held = s[10] > 0 ? (HELD_COMPLIANCE * s[9]) / s[10] : 0;
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
      this.compliance = Float64Array.from(read.floats(vectors * vectors));
      this.shapes = splitTriangle(read.counts[5]);
      this.frame();
      this.contacts = [];
      for (let i = 0; i < read.counts[4]; i++) this.contacts.push(this.contact(read));
      this.touches = [];
      for (let i = 0; i < read.places; i++) this.touches.push(touchPlace(read, n));
      read.end();
      this.moved = new Float64Array(3 * stored);
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
      const loads = read.floats(3 * r);
      one.rest = Float64Array.from(read.floats(r * r));
      one.volumes = read.floats(m);
      one.mu = read.floats(m);
      one.lam = read.floats(m);
      one.slopes = read.columns(9 * m, r);
      const scale = read.floats(r), packed = read.take(Int16Array, r * vectors);
      one.coefficients = new Float64Array(r * vectors);
      for (let i = 0; i < packed.length; i++) one.coefficients[i] = packed[i] * scale[Math.floor(i / vectors)];
      one.noise = 0;
      for (let i = 0; i < m; i++) one.noise += 4e-15 * one.volumes[i] * (one.mu[i] + one.lam[i]);
      one.loads = movedBy(one, this.disc(one.place, one.normal)); // less its own, to which that of a press is added
      for (let i = 0; i < r; i++) for (let d = 0; d < 3; d++) one.loads[d * r + i] = loads[3 * i + d] - one.loads[d * r + i];
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
      const near = [];
      for (let k = 0; k < Math.min(3, order.length); k++) {
        if (!(shares[k] > 1e-3 * total)) continue;
        const one = this.contacts[order[k]], loads = movedBy(one, disc);
        for (let i = 0; i < loads.length; i++) loads[i] += one.loads[i];
        near.push({ one, weight: shares[k], loads, ...atRest(one) });
      }
      total = near.reduce((sum, each) => sum + each.weight, 0);
      for (const each of near) each.weight /= total;
      return { disc, near, normal, apart: apart[order[0]] };
    }

    // what a press has beyond its linear part
    bent(place, force) {
      const { vectors } = this, more = new Float64Array(vectors), parts = [];
      let least = Infinity, far = 0, left = 0, spread = 0;
      for (const each of place.near) {
        const { one } = each, load = loadOf(each, force), part = new Float64Array(vectors);
        left = Math.max(left, settle(each, load, RESIDUAL_TOLERANCE));
        for (let i = 0; i < one.r; i++) {
          const by = each.q[i] - load[i];
          for (let v = 0; v < vectors; v++) part[v] += by * one.coefficients[i * vectors + v];
        }
        for (let v = 0; v < vectors; v++) more[v] += each.weight * part[v];
        parts.push(part);
        least = Math.min(least, each.least);
        far = Math.max(far, norm(each.q) / one.reach);
      }
      for (let v = 0; v < vectors; v++)
        for (let k = 0; k < parts.length; k++) spread += place.near[k].weight * (parts[k][v] - more[v]) ** 2;
      return { more, size: norm(more), spread: Math.sqrt(spread), least, far, left };
    }

    // what forces on a disc move, all three at once: the compliance, which is symmetric, times (3, vectors)
    times(disc) {
      const { vectors, compliance } = this, found = new Float64Array(3 * vectors);
      for (let i = 0, at = 0; i < vectors; i++) {
        let a = 0, b = 0, c = 0;
        for (let j = 0; j < vectors; j++, at++) {
          const by = compliance[at];
          a += by * disc[j];
          b += by * disc[vectors + j];
          c += by * disc[2 * vectors + j];
        }
        found[i] = a;
        found[vectors + i] = b;
        found[2 * vectors + i] = c;
      }
      return found;
    }

    // coordinates of the linear part of all presses in the vectors
    linear(places, forces) {
      const { vectors, compliance } = this, loaded = new Float64Array(vectors), sum = new Float64Array(vectors);
      places.forEach(({ disc }, k) => {
        for (let d = 0; d < 3; d++) for (let v = 0; v < vectors; v++) loaded[v] += forces[3 * k + d] * disc[d * vectors + v];
      });
      for (let j = 0, at = 0; j < vectors; j++) {
        const by = loaded[j];
        for (let i = 0; i < vectors; i++, at++) sum[i] += by * compliance[at];
      }
      return sum;
    }

    // how far [m] a place is moved straight in by as hard a force as it is known to bear, if responses are linear
    depth(press) {
      const { vectors } = this, place = this.place(press), axes = [0, 1, 2];
      const row = (all, d) => all.subarray(d * vectors, (d + 1) * vectors), moved = this.times(place.disc);
      const matrix = () => axes.map((e) => axes.map((d) => dot(row(place.disc, e), row(moved, d))));
      const hardest = place.near.reduce((sum, { one, weight }) => sum + weight / Math.hypot(...one.bearing), 0);
      if (!eigen(matrix()).values.every((each) => each > this.held)) return 0;
      return hardest / Math.hypot(...solve(matrix(), [...place.normal]));
    }

    // coordinates of all presses in the vectors
    all(places, forces) {
      const { vectors } = this, sum = this.linear(places, forces);
      const bent = places.map((place, k) => this.bent(place, forces.subarray(3 * k, 3 * k + 3)));
      for (const each of bent) for (let v = 0; v < vectors; v++) sum[v] += each.more[v];
      return { sum, bent };
    }

    // from: an answer to similar presses, in the same order, where this one begins; it saves time only, and what is
    // doubted is answered from the beginning
    respond(presses, { from = null } = {}) {
      must(Array.isArray(presses) && presses.every((press) => press !== null && typeof press === "object"), "presses are a list of objects");
      must(presses.length <= MOST_PRESSES, `more than ${MOST_PRESSES} presses are asked for`);
      const begin = now(), k = presses.length, places = presses.map((press) => this.place(press));
      const moves = presses.map((press) => press.moved !== undefined && press.moved !== null);
      must(!presses.some((press, i) => moves[i] && (press.force ?? null) !== null), "a press has a force or is moved, and not both");
      const given = new Float64Array(3 * k), forces = new Float64Array(3 * k);
      presses.forEach((press, i) => given.set(numbers(press, moves[i] ? "moved" : "force"), 3 * i));
      places.forEach((place, i) => {
        const known = goOn(place, from && !from.doubt && from.rest ? from.rest[i] : null);
        if (!moves[i]) forces.set(given.subarray(3 * i, 3 * i + 3), 3 * i);
        else if (known) forces.set(from.forces.subarray(3 * i, 3 * i + 3), 3 * i);
      });
      const search = moves.some(Boolean) ? this.search(places, given, forces, moves) : { missed: 0, doubt: "" };
      const { sum, bent } = this.all(places, forces);
      const displacement = new Float32Array(3 * this.n);
      const peak = Math.max(this.expand(sum, displacement), 1e-30);
      if (!Number.isFinite(peak) || !forces.every(Number.isFinite)) {
        displacement.fill(0);
        const doubt = "the numbers of this answer are beyond what can be stored";
        return { displacement, forces: new Float32Array(3 * k), error: 1, doubt, rest: [], ms: now() - begin };
      }
      let error = this.floor + search.missed / peak, sizes = 0, most = 0;
      for (const each of bent) {
        error += (this.share * each.size + this.spread * each.spread) / peak;
        sizes += each.size;
        most = Math.max(most, each.size);
      }
      error = search.doubt ? 1 : Math.min(error + (this.several * (sizes - most)) / peak, 1);
      let { doubt } = search;
      places.forEach((place, i) => (doubt = doubt || this.doubt(place, bent[i], forces.subarray(3 * i, 3 * i + 3))));
      if (doubt && from) return this.respond(presses);
      const rest = places.map((place) => place.near);
      return { displacement, forces: Float32Array.from(forces), error, doubt, rest, ms: now() - begin };
    }

    // push the instrument of a place from first touch to a depth [m], along a direction or straight in
    touch({ place, depth, direction = null }) {
      must(Number.isInteger(place) && place >= 0 && place < this.touches.length, `the touch is at place ${place}, which is not there`);
      must(Number.isFinite(depth) && depth >= 0, "a touch needs a finite depth of 0 or more");
      const begin = now(), one = this.touches[place], { r, axes, first: c } = one, row = (d) => axes.subarray(3 * d, 3 * d + 3);
      let way = direction === null ? Array.from(row(2), (each) => -each) : numbers({ direction }, "direction");
      const length = Math.sqrt(inner(way, way));
      must(length > 0 && length < Infinity, "the direction of a touch has no length");
      way = way.map((each) => each / length);
      const local = [0, 1, 2].map((d) => inner(way, row(d))), [x, y] = local;
      const along = c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y + depth;
      const tip = way.map((each, d) => this.nodes[3 * one.node + d] + along * each), q = new Float64Array(r);
      for (let k = 0; k < one.k; k++) {
        const alike = (inner(local, one.pushed.subarray(3 * k, 3 * k + 3)) * depth) / one.deepest;
        const by = alike + alike * alike + alike * alike * alike;
        for (let i = 0; i < r; i++) q[i] += by * one.starts[k * r + i];
      }
      const { frames, left, q: found } = settleTouch(one, tip, q), force = [0, 0, 0], displacement = new Float32Array(3 * this.n);
      let area = 0;
      for (let n = 0; n < one.p; n++) {
        const at = FRAME * n, push = one.areas[n] * one.penalty[n] * Math.max(-frames[at], 0);
        for (let d = 0; d < 3; d++) force[d] += push * frames[at + 1 + d];
        if (frames[at] < 0) area += one.stretched * one.areas[n];
      }
      for (let i = 0, at = 0; i < displacement.length; i++) {
        let sum = 0;
        for (let k = 0; k < r; k++, at++) sum += one.surface[at] * found[k];
        displacement[i] = sum;
      }
      const forceAlong = inner(force, way), share = Math.min(Math.hypot(x, y) / Math.sin((TILTED * Math.PI) / 180), 1);
      const error = one.error + share * Math.max(one.tiltedError - one.error, 0);
      const forceError = one.forceError + share * Math.max(one.tiltedForceError - one.forceError, 0);
      if (!displacement.every(Number.isFinite) || !Number.isFinite(forceAlong)) {
        const doubt = "the numbers of this answer are beyond what can be stored", nothing = { force: [0, 0, 0], forceAlong: 0, area: 0 };
        return { displacement: displacement.fill(0), ...nothing, error: 1, forceError: 1, doubt, tip, ms: now() - begin };
      }
      let doubt = "";
      if (!(left <= TOUCH_RESIDUAL)) doubt = `the model found no rest: ${(100 * left).toFixed(1)} % of the load are left`;
      else if (!(depth <= ROUNDING * one.deepest)) doubt = `this is deeper than the ${(1e3 * one.deepest).toFixed(1)} mm that were prepared`;
      else if (!(-local[2] * ROUNDING >= Math.cos((STEEPEST * Math.PI) / 180))) doubt = `the direction is more than ${STEEPEST} degrees off the normal`;
      return { displacement, force, forceAlong, area, error, forceError, doubt, tip, ms: now() - begin };
    }

    // bring coordinates to all nodes; return the largest displacement, NaN if a number is not finite
    expand(sum, out) {
      const { n, stored, vectors, basis, moved, from, by } = this, size = 3 * stored;
      moved.fill(0);
      let v = 0;
      for (; v + 7 < vectors; v += 8) {
        const a = sum[v], b = sum[v + 1], c = sum[v + 2], d = sum[v + 3];
        const e = sum[v + 4], f = sum[v + 5], g = sum[v + 6], h = sum[v + 7];
        for (let i = v * size, j = 0; j < size; i++, j++) {
          const one = a * basis[i] + b * basis[i + size] + c * basis[i + 2 * size] + d * basis[i + 3 * size];
          const two = e * basis[i + 4 * size] + f * basis[i + 5 * size] + g * basis[i + 6 * size] + h * basis[i + 7 * size];
          moved[j] += one + two;
        }
      }
      for (; v < vectors; v++) for (let i = 0; i < size; i++) moved[i] += sum[v] * basis[v * size + i];
      let most = 0, total = 0;
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
        total += square;
        if (square > most) most = square;
      }
      return Number.isFinite(total) && Number.isFinite(Math.fround(Math.sqrt(most))) ? Math.sqrt(most) : NaN;
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

    // find the forces of moved discs by Newton's method, from those in `force` on: in what discs do alone, so that the
    // whole surface is not asked for; contacts come to rest the closer the nearer the discs are to their way
    search(places, given, force, moves) {
      const { vectors } = this, moved = [];
      moves.forEach((each, i) => each && moved.push(3 * i, 3 * i + 1, 3 * i + 2));
      const row = (i) => places[Math.floor(i / 3)].disc.subarray((i % 3) * vectors, ((i % 3) + 1) * vectors);
      const discs = places.filter((_, i) => moves[i]).map((place) => place.disc), parts = discs.map((disc) => this.times(disc));
      const linear = moved.map((_, i) => {
        const part = parts[Math.floor(i / 3)].subarray((i % 3) * vectors, ((i % 3) + 1) * vectors);
        return Float64Array.from(force, (_, j) => dot(part, row(j)));
      });
      for (const { near } of places) for (const each of near) each.seen = discs.map((disc) => movedBy(each.one, disc));
      const others = linear.map((each) => each.reduce((sum, by, j) => sum + (moves[Math.floor(j / 3)] ? 0 : by * given[j]), 0));
      const wanted = moved.map((i) => given[i]), ways = independent(linear, moved, this.held);
      const along = (x) => Math.hypot(...ways.map((way) => inner(way, x)));
      const scale = Math.max(along(wanted), along(others), 1e-300); // a held disc has a way to go, too
      const way = Math.max(Math.hypot(...wanted), Math.hypot(...others), 1e-300), all = { places, wanted, linear, moved, ways };
      let { step, missed } = lookAhead(all, force), size = scale, tolerance = FIRST_TOLERANCE;
      for (let turn = 0; turn < MOST_SEARCH_STEPS && !(size <= FORCE_SEARCH_TOLERANCE * scale && tolerance <= RESIDUAL_TOLERANCE); turn++) {
        tolerance = Math.max(RESIDUAL_TOLERANCE, FIRST_TOLERANCE * Math.min(1, size / scale));
        const tried = force.map((each, i) => each + step[i]), before = places.map(({ near }) => near.map((each) => ({ ...each })));
        places.forEach(({ near }, i) => {
          for (const each of near) settle(each, loadOf(each, tried.subarray(3 * i, 3 * i + 3)), tolerance);
        });
        const ahead = lookAhead(all, tried), { found } = ahead;
        if (found < 1.5 * size || found <= FORCE_SEARCH_TOLERANCE * scale) {
          force.set(tried);
          ({ step, missed } = ahead);
          size = found;
          continue;
        }
        step = step.map((each) => 0.5 * each);
        before.forEach((each, i) => each.forEach(({ q, energy, pull, least }, k) => Object.assign(places[i].near[k], { q, energy, pull, least })));
      }
      const lost = Math.hypot(...missed), share = lost / way;
      if (!(size <= 1e-3 * scale && lost < Infinity)) return { missed: lost, doubt: "no force was found that moves the disc as far as it is pushed" };
      const doubt = `a disc is held there, or too near another, and misses its way by ${(100 * share).toFixed(0)} %`;
      return { missed: lost, doubt: share <= MOST_MISSED ? "" : doubt };
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

  function norm(x) {
    return Math.sqrt(dot(x, x));
  }

  // how a contact's coordinates move a disc, (3, r)
  function movedBy({ r, coefficients }, disc) {
    const vectors = coefficients.length / r, found = new Float64Array(3 * r);
    for (let i = 0, at = 0; i < r; i++) {
      let a = 0, b = 0, c = 0;
      for (let v = 0; v < vectors; v++, at++) {
        const by = coefficients[at];
        a += disc[v] * by;
        b += disc[vectors + v] * by;
        c += disc[2 * vectors + v] * by;
      }
      found[i] = a;
      found[r + i] = b;
      found[2 * r + i] = c;
    }
    return found;
  }

  // a contact without a load; inverse is that of its stiffness, the identity until steps have shown more
  function atRest({ r }) {
    return { q: new Float64Array(r), pull: new Float64Array(r), energy: 0, least: 1, inverse: null };
  }

  // begin where an earlier answer has left the contacts that it shares, and say whether there are any
  function goOn(place, earlier) {
    let known = false;
    for (const each of place.near) {
      const left = earlier ? earlier.find(({ one }) => one === each.one) : null;
      if (!left) continue;
      const { q, pull, energy, least, inverse } = left;
      Object.assign(each, { q, pull, energy, least, inverse: inverse && inverse.slice() });
      known = true;
    }
    return known;
  }

  function loadOf({ loads }, force) {
    const r = loads.length / 3, load = new Float64Array(r);
    for (let i = 0; i < r; i++) load[i] = force[0] * loads[i] + force[1] * loads[r + i] + force[2] * loads[2 * r + i];
    return load;
  }

  // forces that move discs independently: each disc counts over its mean response, not at all if that is what a held one
  // has, and discs that are nearly the same one move alike only
  function independent(linear, moved, held) {
    const by = moved.map((_, i) => {
      const first = i - (i % 3), mean = [0, 1, 2].reduce((sum, d) => sum + linear[first + d][moved[first + d]] / 3, 0);
      return mean > held ? 1 / Math.sqrt(mean) : 0;
    });
    const { values, vectors } = eigen(moved.map((_, i) => moved.map((j, k) => by[i] * by[k] * linear[i][j])));
    return vectors.map((each) => each.map((x, i) => by[i] * x)).filter((_, k) => values[k] > LEAST_EIGENVALUE);
  }

  // eigenvalues of a symmetric matrix, and rows of eigenvectors, by Jacobi's rotations
  function eigen(a) {
    const n = a.length, vectors = a.map((_, i) => a.map((_, j) => (i === j ? 1 : 0)));
    for (let turn = 0; turn < 30 * n * n; turn++) {
      const p = Math.floor(turn / n) % n, q = turn % n, off = a[p][q], apart = a[q][q] - a[p][p];
      if (q <= p || !(Math.abs(off) > 1e-18 * (Math.abs(a[p][p]) + Math.abs(a[q][q])))) continue;
      const t = ((apart < 0 ? -2 : 2) * off) / (Math.abs(apart) + Math.sqrt(apart * apart + 4 * off * off));
      const c = 1 / Math.sqrt(t * t + 1), s = t * c;
      for (const each of a) [each[p], each[q]] = [c * each[p] - s * each[q], s * each[p] + c * each[q]];
      for (const each of [a, vectors])
        for (let k = 0; k < n; k++) [each[p][k], each[q][k]] = [c * each[p][k] - s * each[q][k], s * each[p][k] + c * each[q][k]];
    }
    return { values: a.map((row, i) => row[i]), vectors };
  }

  // what discs miss, a step of forces towards it that foresees where contacts will rest, and how far both are
  function lookAhead({ places, wanted, linear, moved, ways }, force) {
    const missed = wanted.map((each, i) => each - dot(linear[i], force)), slope = linear.map((each) => each.slice());
    const foreseen = new Float64Array(missed.length);
    places.forEach(({ near }, press) => {
      for (const each of near) {
        const { r } = each.one, load = loadOf(each, force.subarray(3 * press, 3 * press + 3)), left = load.slice();
        for (let i = 0; i < r; i++) left[i] -= each.pull[i];
        const columns = [0, 1, 2].map((d) => bentBy(each, each.loads.subarray(d * r, (d + 1) * r)));
        columns.forEach((column, d) => {
          for (let i = 0; i < r; i++) column[i] -= each.loads[d * r + i];
        });
        const ahead = bentBy(each, left);
        for (let i = 0; i < r; i++) left[i] = each.q[i] - load[i];
        for (let i = 0; i < moved.length; i++) {
          const seen = each.seen[Math.floor(i / 3)].subarray((i % 3) * r, ((i % 3) + 1) * r);
          missed[i] -= each.weight * dot(seen, left);
          foreseen[i] += each.weight * dot(seen, ahead);
          for (let d = 0; d < 3; d++) slope[i][3 * press + d] += each.weight * dot(seen, columns[d]);
        }
      }
    });
    const rows = ways.map((way) => moved.map((j) => way.reduce((sum, each, i) => sum + each * slope[i][j], 0)));
    const off = ways.map((way) => inner(way, missed)), rest = ways.map((way) => inner(way, foreseen));
    const solved = solve(rows.map((row) => ways.map((way) => inner(row, way))), off.map((each, i) => each - rest[i]));
    const step = new Float64Array(force.length);
    moved.forEach((j, i) => ways.forEach((way, k) => (step[j] += way[i] * solved[k])));
    return { missed, step, found: Math.hypot(...off) + Math.hypot(...rest) };
  }

  // solve by elimination, of a matrix whose pivots are above 0; otherwise the answer is 0
  function solve(rows, x) {
    for (let k = 0; k < x.length; k++) {
      const pivot = rows[k][k];
      if (!(pivot > 0)) return x.map(() => 0);
      for (let j = 0; j < x.length; j++) rows[k][j] /= pivot;
      x[k] /= pivot;
      for (let i = 0; i < x.length; i++) {
        const by = rows[i][k];
        if (i === k) continue;
        x[i] -= by * x[k];
        for (let j = 0; j < x.length; j++) rows[i][j] -= by * rows[k][j];
      }
    }
    return x;
  }

  // by how much a load would change the coordinates
  function bentBy({ inverse }, load) {
    const found = load.slice(), r = load.length;
    for (let i = 0, at = 0; inverse && i < r; i++) {
      let sum = 0;
      for (let k = 0; k < r; k++, at++) sum += inverse[at] * load[k];
      found[i] = sum;
    }
    return found;
  }

  // learn the inverse of the stiffness from a step, by the method of Broyden, Fletcher, Goldfarb and Shanno
  function learn(each, step, bend) {
    const r = step.length, curvature = dot(step, bend);
    if (!(curvature > 0)) return;
    if (!each.inverse) {
      each.inverse = new Float64Array(r * r);
      for (let i = 0; i < r; i++) each.inverse[i * (r + 1)] = 1;
    }
    const along = bentBy(each, bend), both = (1 + dot(bend, along) / curvature) / curvature, { inverse } = each;
    for (let i = 0, at = 0; i < r; i++) {
      const by = both * step[i] - along[i] / curvature, back = step[i] / curvature;
      for (let k = 0; k < r; k++, at++) inverse[at] += by * step[k] - back * along[k];
    }
  }

  // minimise the energy of a contact's cells less the work of the load, from where it is on; return the residual over
  // the load
  function settle(each, load, enough) {
    const { one } = each, { r } = one, size = norm(load), left = new Float64Array(r);
    for (let turn = 0; ; turn++) {
      for (let i = 0; i < r; i++) left[i] = load[i] - each.pull[i];
      const residual = norm(left);
      if (residual <= enough * size || turn === ITERATIONS) return residual / Math.max(size, 1e-300);
      const ahead = bentBy(each, left), slope = dot(left, ahead), energy = each.energy - dot(load, each.q);
      const q = new Float64Array(r), pull = new Float64Array(r);
      let length = 1, found = null;
      while (slope > 0 && length > 1e-4) {
        for (let i = 0; i < r; i++) q[i] = each.q[i] + length * ahead[i];
        const [inside, least] = evaluate(one, q, pull), lower = inside - dot(load, q);
        if (lower <= energy - 1e-4 * length * slope + 1e-12 * Math.abs(energy) + one.noise) {
          found = { q, pull, energy: inside, least };
          break;
        }
        length *= 0.5;
      }
      if (!found) {
        if (!each.inverse) return residual / Math.max(size, 1e-300);
        each.inverse = null;
        continue;
      }
      for (let i = 0; i < r; i++) {
        left[i] = q[i] - each.q[i];
        ahead[i] = pull[i] - each.pull[i];
      }
      learn(each, left, ahead);
      Object.assign(each, found);
    }
  }

  // add a weight times the product of two rows of r numbers to a matrix
  function outer(into, rows, a, b, weight, r) {
    for (let i = 0; i < r; i++) {
      const by = weight * rows[a + i];
      for (let j = 0; j < r; j++) into[i * r + j] += by * rows[b + j];
    }
  }

  // a place that a rigid instrument was prepared at, in r coordinates with m cells, p points that may be touched, and k past
  // pushes; a ball is a punch whose edge is its radius
  function touchPlace(read, n) {
    const [node, kind, r, m, p, k] = read.take(Uint32Array, 6);
    const sound = node < n && kind < KINDS.length && r > 0 && r <= MOST_MODES && m <= MOST_CELLS;
    must(sound && p <= MOST_POINTS && k <= MOST_PUSHES, "a place to touch has sizes that are none");
    const [radius, edge, deepest, stretched, error, forceError, tiltedError, tiltedForceError] = read.floats(8);
    const lengths = radius > 0 && edge >= 0 && edge <= radius && deepest > 0;
    must(lengths && Math.min(stretched, error, forceError, tiltedError, tiltedForceError) >= 0, "a place to touch has lengths or errors that are none");
    const axes = read.doubles(9), first = read.doubles(6), rest = read.doubles(r * r);
    const volumes = read.doubles(m), mu = read.doubles(m), lam = read.doubles(m), slopes = read.columns(9 * m, r);
    const points = read.doubles(3 * p), moves = read.columns(3 * p, r), areas = read.doubles(p), penalty = read.doubles(p);
    const stiff = penalty.every((each) => each > 0) && areas.every((each) => each >= 0);
    must(stiff, "a place to touch has areas or stiffnesses that are none");
    const pushed = read.doubles(3 * k), starts = read.doubles(k * r), surface = read.columns(3 * n, r);
    const firm = rest.slice(), f = new Float64Array(9 * m), rows = new Float64Array(7 * r);
    for (let i = 0; i < 9 * m; i++) outer(firm, slopes, i * r, i * r, 2 * mu[i % m] * volumes[i % m], r);
    const noise = volumes.reduce((sum, volume, i) => sum + 4e-15 * volume * (mu[i] + lam[i]), 0), outward = axes.subarray(6);
    const told = { node, kind: KINDS[kind], radius, edge, deepest, stretched, error, forceError, tiltedError, tiltedForceError, axes, outward, first };
    return { ...told, r, m, p, k, rest, firm, volumes, mu, lam, slopes, f, noise, points, moves, areas, penalty, pushed, starts, surface, rows };
  }

  // gap of a point from the tip, normal, two tangents, and how the instrument is curved along these; inside, the nearer of
  // end and side counts
  function seePoint({ radius, edge, axes: e }, a, b, c, frames, at) {
    const x = e[0] * a + e[1] * b + e[2] * c, y = e[3] * a + e[4] * b + e[5] * c, z = e[6] * a + e[7] * b + e[8] * c;
    const rho = Math.sqrt(x * x + y * y), safe = Math.max(rho, 1e-300), out = rho - (radius - edge), below = edge - z;
    const edged = out > 0 && below > 0, away = edged ? Math.sqrt(out * out + below * below) : Math.max(out, below);
    const far = edged ? Math.max(away, 1e-300) : 1, side = edged ? out / far : Number(out > below), down = edged ? below / far : Number(out <= below);
    frames[at] = away - edge;
    frames[at + 10] = side / safe;
    frames[at + 11] = edged ? 1 / far : 0;
    for (let d = 0; d < 3; d++) {
      const radial = (x * e[d] + y * e[3 + d]) / safe;
      frames[at + 1 + d] = side * radial - down * e[6 + d];
      frames[at + 4 + d] = (x * e[3 + d] - y * e[d]) / safe;
      frames[at + 7 + d] = down * radial + side * e[6 + d];
    }
  }

  // energy of a place's cells and of contact with the instrument, its gradient, the pull of contact, and the points' frames
  function touched(one, tip, q) {
    const { r, p, points, moves } = one, gradient = new Float64Array(r), pull = new Float64Array(r), frames = new Float64Array(FRAME * p);
    let [energy] = evaluate(one, q, gradient);
    for (let n = 0, at = 0; n < p; n++, at += FRAME) {
      const first = 3 * n * r;
      let a = points[3 * n] - tip[0], b = points[3 * n + 1] - tip[1], c = points[3 * n + 2] - tip[2];
      for (let i = 0, j = first; i < r; i++, j++) {
        a += moves[j] * q[i];
        b += moves[j + r] * q[i];
        c += moves[j + 2 * r] * q[i];
      }
      seePoint(one, a, b, c, frames, at);
      const over = Math.max(-frames[at], 0), push = one.areas[n] * one.penalty[n] * over;
      energy += 0.5 * push * over;
      for (let i = 0, j = first; push > 0 && i < r; i++, j++)
        pull[i] += push * (frames[at + 1] * moves[j] + frames[at + 2] * moves[j + r] + frames[at + 3] * moves[j + 2 * r]);
    }
    for (let i = 0; i < r; i++) gradient[i] -= pull[i];
    return { q, energy, gradient, pull, frames };
  }

  // what of the Hessian is positive definite, and the rest, rotations and the instrument's curves. R turns by 1/G a, where a is
  // the axis of δF Rᵀ − R δFᵀ and G = s I − F Rᵀ
  function touchStiffness(one, { q, frames }) {
    const { r, m, p, slopes, rows, moves } = one, stiff = one.firm.slice(), soft = new Float64Array(r * r);
    const F = new Float64Array(9), R = new Float64Array(9), C = new Float64Array(9), G = new Float64Array(9);
    for (let k = 0; k < m; k++) {
      for (let i = 0; i < 9; i++) {
        F[i] = i % 4 ? 0 : 1;
        for (let j = 0, at = (i * m + k) * r; j < r; j++, at++) F[i] += slopes[at] * q[j];
      }
      const s = turn(F, R);
      for (let i = 0; i < 3; i++)
        for (let j = 0; j < 3; j++) {
          let both = 0;
          for (let d = 0; d < 3; d++) both += F[3 * i + d] * R[3 * j + d] + F[3 * j + d] * R[3 * i + d];
          G[3 * i + j] = (i === j ? s : 0) - 0.5 * both;
        }
      cofactors(G, C);
      const size = G[0] * C[0] + G[1] * C[1] + G[2] * C[2];
      rows.fill(0);
      for (let i = 0; i < 9; i++) {
        // δF Rᵀ has the entries of row i / 3 in columns a and b
        const d = i % 3, row = (i - d) / 3, a = (row + 2) % 3, b = (row + 1) % 3, by = R[i], up = R[3 * a + d], down = R[3 * b + d];
        for (let j = 0, at = (i * m + k) * r; j < r; j++, at++) {
          rows[j] += by * slopes[at];
          rows[(1 + b) * r + j] += up * slopes[at];
          rows[(1 + a) * r + j] -= down * slopes[at];
        }
      }
      outer(stiff, rows, 0, 0, one.lam[k] * one.volumes[k], r);
      if (!(size > 1e-6)) continue;
      const share = (one.volumes[k] * (one.lam[k] * (s - 3) - 2 * one.mu[k])) / size;
      for (let i = 0; i < 3; i++) {
        for (let j = 0; j < r; j++) rows[(4 + i) * r + j] = C[3 * i] * rows[r + j] + C[3 * i + 1] * rows[2 * r + j] + C[3 * i + 2] * rows[3 * r + j];
        outer(soft, rows, (1 + i) * r, (4 + i) * r, share, r);
      }
    }
    for (let n = 0, at = 0; n < p; n++, at += FRAME) {
      const push = one.areas[n] * one.penalty[n];
      for (let v = 0; frames[at] < 0 && v < 3; v++) {
        const x = frames[at + 1 + 3 * v], y = frames[at + 2 + 3 * v], z = frames[at + 3 + 3 * v];
        for (let i = 0, j = 3 * n * r; i < r; i++, j++) rows[i] = x * moves[j] + y * moves[j + r] + z * moves[j + 2 * r];
        outer(v ? soft : stiff, rows, 0, 0, v ? push * frames[at] * frames[at + 9 + v] : push, r);
      }
    }
    return { stiff, soft };
  }

  function cofactors(F, C) {
    for (let i = 0; i < 9; i++) {
      const a = 3 * ((Math.floor(i / 3) + 1) % 3), b = 3 * ((Math.floor(i / 3) + 2) % 3), c = (i + 1) % 3, d = (i + 2) % 3;
      C[i] = F[a + c] * F[b + d] - F[a + d] * F[b + c];
    }
  }

  // write the rotation of F and return s = tr RᵀF, as in evaluate
  function turn(F, R) {
    const C = new Float64Array(9);
    cofactors(F, C);
    const first = dot(F, F), second = dot(C, C), det = F[0] * C[0] + F[1] * C[1] + F[2] * C[2], s = root(first, second, det);
    const off = s * s - first, bottom = Math.max(s * off - 2 * det, 1e-12);
    for (let i = 0; i < 9; i++) {
      const row = i - (i % 3), column = i % 3;
      let cube = 0;
      for (let k = 0; k < 3; k++) cube += F[row + k] * (F[k] * F[column] + F[3 + k] * F[3 + column] + F[6 + k] * F[6 + column]);
      R[i] = (off * F[i] + 2 * (first * F[i] - cube) + 2 * s * C[i]) / bottom;
    }
    return s;
  }

  // minimise the energy of a place from q on by Newton's method, and, where its matrix is not positive definite, by what of it
  // always is; left is the residual over the force of contact
  function settleTouch(one, tip, q) {
    const { r } = one, matrix = (flat) => Array.from({ length: r }, (_, i) => flat.slice(i * r, i * r + r));
    let now = touched(one, tip, q), scale = 0;
    for (let turns = 0; ; turns++) {
      scale = norm(now.pull) || scale;
      const size = norm(now.gradient), left = size > 0 && scale > 0 ? size / scale : size;
      if (left <= TOUCH_TOLERANCE || turns === TOUCH_ITERATIONS) return { ...now, left };
      const { stiff, soft } = touchStiffness(one, now), back = now.gradient.map((each) => -each);
      for (let i = 0; i < r * r; i++) soft[i] += stiff[i];
      let step = solve(matrix(soft), back.slice());
      if (!(dot(now.gradient, step) < 0)) step = solve(matrix(stiff), back);
      const slope = dot(now.gradient, step);
      let found = null;
      for (let length = 1; slope < 0 && length > 1e-4 && !found; length *= 0.5) {
        const tried = touched(one, tip, now.q.map((each, i) => each + length * step[i]));
        if (tried.energy <= now.energy + 1e-4 * length * slope + 1e-12 * Math.abs(now.energy) + one.noise) found = tried;
      }
      if (!found) return { ...now, left };
      now = found;
    }
  }

  // s = tr RᵀF, the largest root of (s² − I)² = 4 II + 8 J s
  function root(first, second, det) {
    let s = Math.sqrt(3 * first);
    for (let turns = 0; turns < 30; turns++) {
      const off = s * s - first;
      const change = (off * off - 4 * second - 8 * det * s) / Math.max(4 * s * off - 8 * det, 1e-12);
      s -= change;
      if (!(Math.abs(change) > 1e-13 * s)) break;
    }
    return s;
  }

  // energy and smallest det F; the gradient is written
  function evaluate(one, q, gradient) {
    const { r, m, slopes, f, rest } = one;
    let energy = 0, least = Infinity;
    for (let i = 0, at = 0; i < 9 * m; i += 3, at += 2 * r) {
      let x = 0, y = 0, z = 0; // three rows at once: one sum alone waits for itself
      for (let k = 0; k < r; k++, at++) {
        x += slopes[at] * q[k];
        y += slopes[at + r] * q[k];
        z += slopes[at + 2 * r] * q[k];
      }
      f[i] = x;
      f[i + 1] = y;
      f[i + 2] = z;
    }
    for (let k = 0; k < m; k++) {
      const a = f[k] + 1, b = f[m + k], c = f[2 * m + k], d = f[3 * m + k], e = f[4 * m + k] + 1, g = f[5 * m + k];
      const h = f[6 * m + k], i = f[7 * m + k], j = f[8 * m + k] + 1;
      const C0 = e * j - g * i, C1 = g * h - d * j, C2 = d * i - e * h, C3 = c * i - b * j, C4 = a * j - c * h;
      const C5 = b * h - a * i, C6 = b * g - c * e, C7 = c * d - a * g, C8 = a * e - b * d, det = a * C0 + b * C1 + c * C2;
      const p = a * a + d * d + h * h, u = b * b + e * e + i * i, w = c * c + g * g + j * j, first = p + u + w;
      const x = a * b + d * e + h * i, y = a * c + d * g + h * j, z = b * c + e * g + i * j;
      const second = C0 * C0 + C1 * C1 + C2 * C2 + C3 * C3 + C4 * C4 + C5 * C5 + C6 * C6 + C7 * C7 + C8 * C8;
      const s = root(first, second, det), off = s * s - first, mu = one.mu[k], lam = one.lam[k], volume = one.volumes[k];
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
      energy += 0.5 * q[i] * pull;
      gradient[i] = pull;
    }
    for (let i = 0, at = 0; i < 9 * m; i += 3, at += 2 * r) {
      const x = f[i], y = f[i + 1], z = f[i + 2];
      for (let k = 0; k < r; k++, at++) gradient[k] += x * slopes[at] + y * slopes[at + r] + z * slopes[at + 2 * r];
    }
    return [energy, least];
  }


  return { load: (buffer) => new Model(buffer), VERSION };
})();
if (typeof module !== "undefined") module.exports = Palpate;
