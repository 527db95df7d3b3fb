// Arrows of forces, drawn with the surface: lines of a document above it would be painted and laid over it anew each time.
const ARROW_CORNERS = `#version 300 es
uniform vec4 shaft; uniform vec2 size; uniform float sharp;
out vec2 at;
void main() {
  vec2 along = shaft.zw - shaft.xy, way = along / max(length(along), 1e-6), corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  at = mix(vec2(-4.0, -9.0), vec2(length(along) + 4.0, 9.0), corner);
  vec2 place = (shaft.xy + at.x * way + at.y * vec2(-way.y, way.x)) * sharp / size;
  gl_Position = vec4(2.0 * place.x - 1.0, 1.0 - 2.0 * place.y, 0.0, 1.0);
}`;
const ARROW = `#version 300 es
precision highp float;
uniform vec4 shaft; uniform float sharp; uniform float most; uniform float wide; uniform vec3 ink;
in vec2 at; out vec4 shown;
float beside(vec2 p, vec2 q) { // how far from a triangle with its tip at 0, half as wide as q.x, as long as q.y
  p.x = abs(p.x);
  vec2 a = p - q * clamp(dot(p, q) / dot(q, q), 0.0, 1.0), b = p - q * vec2(clamp(p.x / q.x, 0.0, 1.0), 1.0);
  vec2 d = min(vec2(dot(a, a), p.y * q.x - p.x * q.y), vec2(dot(b, b), q.y - p.y));
  return -sqrt(d.x) * sign(d.y);
}
void main() {
  float size = length(shaft.zw - shaft.xy), head = min(most, 0.6 * size);
  float line = distance(at, vec2(clamp(at.x, 0.0, size - head), 0.0));
  float away = head > 0.0 ? min(line, beside(vec2(at.y, size - at.x), vec2(0.45, 1.0) * head)) : line;
  vec2 inside = clamp((wide * vec2(2.5, 1.25) - away) * sharp + 0.5, 0.0, 1.0);
  shown = vec4(mix(vec3(0.067), ink, inside.y), inside.x);
}`;

class Arrows {
  constructor(painter) {
    const { gl } = painter;
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    Object.assign(this, { gl, way: painter.program(ARROW_CORNERS, ARROW, ["shaft", "size", "sharp", "most", "wide", "ink"]), corners: gl.createVertexArray() });
  }

  // shafts: [x from, y from, x to, y to] each, in pixels of the screen; sharp: pixels of the canvas for one of them
  // head: longest tip of an arrow [pixels], 0 for plain lines; wide: over an arrow's width
  draw(shafts, sharp, { head = 11, wide = 1, ink = [1, 1, 1] } = {}) {
    const { gl, way } = this, { width, height } = gl.canvas;
    gl.viewport(0, 0, width, height);
    gl.useProgram(way.program);
    gl.bindVertexArray(this.corners);
    gl.uniform2f(way.size, width, height);
    gl.uniform1f(way.sharp, sharp);
    gl.uniform1f(way.most, head);
    gl.uniform1f(way.wide, wide);
    gl.uniform3fv(way.ink, ink);
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.CULL_FACE);
    gl.enable(gl.BLEND);
    for (const shaft of shafts) {
      gl.uniform4f(way.shaft, ...shaft);
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    }
    gl.disable(gl.BLEND);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
  }
}
