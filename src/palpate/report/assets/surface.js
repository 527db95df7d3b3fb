// Surfaces drawn with WebGL, all by one context, as a browser gives a page only some of them.
const VERTEX = `#version 300 es
in vec3 place; in vec3 colour; in vec3 corner;
uniform mat3 turn; uniform vec3 centre; uniform vec3 scale;
out vec3 seen; out vec3 tint; out vec3 edge;
void main() {
  seen = turn * (place - centre); tint = colour; edge = corner;
  gl_Position = vec4(seen * scale * vec3(1.0, 1.0, -1.0), 1.0);
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 seen; in vec3 tint; in vec3 edge; out vec4 shown;
uniform float lines;
void main() {
  vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
  float light = 0.68 + 0.36 * abs(dot(normal, normalize(vec3(0.35, 0.45, 0.8))));
  vec3 near = smoothstep(vec3(0.0), fwidth(edge) * 1.1, edge);
  float line = lines * (1.0 - min(near.x, min(near.y, near.z)));
  shown = vec4(mix(min(tint * light, 1.0), vec3(0.1), line), 1.0);
}`;

class SharedCanvas {
  constructor() {
    this.canvas = document.createElement("canvas");
    const gl = (this.gl = this.canvas.getContext("webgl2", { antialias: true, alpha: true }));
    if (!gl) return;
    const attributes = ["place", "colour", "corner"];
    this.uniforms = linkProgram(gl, VERTEX, FRAGMENT, ["turn", "centre", "scale", "lines"], attributes);
    gl.useProgram(this.uniforms.program);
    gl.enable(gl.DEPTH_TEST);
    this.buffers = Object.fromEntries(
      attributes.map((name, where) => {
        const buffer = gl.createBuffer();
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
        gl.enableVertexAttribArray(where);
        gl.vertexAttribPointer(where, 3, gl.FLOAT, false, 0, 0);
        return [name, buffer];
      }),
    );
  }

  // Draw corners of triangles, three numbers each, as `turn` (9 numbers, row by row) and `scale` (3) say.
  paint(target, { place, colour, corner, turn, centre, scale, lines }) {
    const { gl, canvas } = this;
    if (canvas.width !== target.width) canvas.width = target.width;
    if (canvas.height !== target.height) canvas.height = target.height;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    for (const [name, data] of Object.entries({ place, colour, corner })) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[name]);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STREAM_DRAW);
    }
    gl.uniformMatrix3fv(this.uniforms.turn, true, turn);
    gl.uniform3fv(this.uniforms.centre, centre);
    gl.uniform3fv(this.uniforms.scale, scale);
    gl.uniform1f(this.uniforms.lines, lines);
    gl.drawArrays(gl.TRIANGLES, 0, place.length / 3);
    const brush = target.getContext("2d");
    brush.clearRect(0, 0, target.width, target.height);
    brush.drawImage(canvas, 0, 0);
  }
}

// What turnable.py packed, as arrays: places (frames × vertices × 3) [m], triangles, shades (frames × vertices).
const surface = async (head) => {
  const [frames, vertices, triangles] = head.counts;
  const bytes = await unpack(head.packed);
  let start = 0;
  const integers = (count, width) => {
    const values = new Uint32Array(count);
    for (let k = 0; k < width; k++) {
      for (let i = 0; i < count; i++) values[i] += bytes[start + k * count + i] * 256 ** k;
    }
    start += count * width;
    return values;
  };
  // numbers that lie side by side over the frames, each as its change from the one before, modulo `range`
  const unchanged = (changes, length, range) => {
    const values = new Uint32Array(changes.length);
    for (let i = 0; i < length; i++) {
      for (let f = 0, sum = 0; f < frames; f++) {
        sum = (sum + changes[i * frames + f]) % range;
        values[f * length + i] = sum;
      }
    }
    return values;
  };
  const whole = unchanged(integers(frames * vertices * 3, 2), vertices * 3, 65536);
  const corners = integers(triangles * 3, 4);
  const shades = unchanged(integers(frames * vertices, 1), vertices, 256);
  const places = Float32Array.from(whole, (value, i) => head.origin[i % 3] + value * head.step);
  return { frames, vertices, corners, places, shades };
};
