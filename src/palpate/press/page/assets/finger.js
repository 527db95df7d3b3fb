// A finger: where it presses the surface at rest, how deep, and how it is tilted from the inward normal.
// `wish` is how deep it is to press, and `depth` as much of that as its place bears.
const STEEP = (60 * Math.PI) / 180; // as far as a finger tilts

class Finger {
  // place: {triangle, weights}; ways: the normals (3 n) of the surface at rest
  constructor(surface, place, depth, tilt = [0, 0]) {
    Object.assign(this, { surface, place, depth, wish: depth, tilt, shown: 0, force: null, pinned: false, leaving: false });
  }

  mix(values) {
    const { triangles } = this.surface, { triangle, weights } = this.place;
    return [0, 1, 2].map((k) => weights.reduce((all, w, c) => all + w * values[3 * triangles[3 * triangle + c] + k], 0));
  }

  get rest() {
    return this.mix(this.surface.nodes);
  }

  // the outward normal, and two directions along the surface that do not jump as the finger slides
  get frame() {
    const normal = unit(this.mix(this.surface.normals));
    const along = Math.abs(normal[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0];
    const first = unit(sum(along, normal, -dot(along, normal)));
    return [normal, first, cross(normal, first)];
  }

  get direction() {
    const [normal, first, second] = this.frame, angle = Math.hypot(...this.tilt);
    const slant = angle ? Math.sin(angle) / angle : 0;
    return sum(sum(normal.map((x) => -Math.cos(angle) * x), first, slant * this.tilt[0]), second, slant * this.tilt[1]);
  }

  tiltBy(way) {
    const [, first, second] = this.frame;
    const tilt = [this.tilt[0] + dot(way, first), this.tilt[1] + dot(way, second)], angle = Math.hypot(...tilt);
    this.tilt = angle > STEEP ? tilt.map((x) => (x * STEEP) / angle) : tilt;
  }

  // the tilt as an angle from the normal and a side, in degrees
  get angles() {
    const degrees = 180 / Math.PI, side = Math.atan2(this.tilt[1], this.tilt[0]) * degrees;
    return [Math.hypot(...this.tilt) * degrees, (side + 360) % 360];
  }

  set angles([angle, side]) {
    const radians = Math.PI / 180;
    this.tilt = [angle * radians * Math.cos(side * radians), angle * radians * Math.sin(side * radians)];
  }

  // as the contract between page and models has it
  get press() {
    const { triangle, weights } = this.place;
    if (this.force) return { triangle, weights, force: this.force };
    return { triangle, weights, moved: this.direction.map((x) => x * this.shown) };
  }

  // one picture nearer to the depth that is asked for; whether there is more to go
  ease(share) {
    const goal = this.leaving ? 0 : this.depth;
    const left = goal - this.shown;
    this.shown = Math.abs(left) < 0.01 * Math.max(goal, 0.002) ? goal : this.shown + share * left;
    return this.shown !== goal;
  }
}
