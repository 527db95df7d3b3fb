// The surface drawn with WebGL. Its nodes bring their colours along, so that most of it costs next to nothing; what marks
// it (rings around fingers, stripes of a doubt) is drawn over it, where there is any.
const VERTEX = `#version 300 es
in vec3 place; in vec4 tint; in vec3 rest;
uniform mat3 turn; uniform vec3 centre; uniform vec3 scale;
out vec4 tinted; out vec3 still;
invariant gl_Position;
void main() {
  tinted = tint; still = rest;
  gl_Position = vec4(turn * (place - centre) * scale * vec3(1.0, 1.0, -1.0), 1.0);
}`;
const PLAIN = `#version 300 es
precision mediump float;
in vec4 tinted; out vec4 shown;
void main() {
  shown = vec4(gl_FrontFacing ? tinted.rgb : vec3(0.73, 0.24, 0.21) * tinted.a, 1.0); // through a cut its inside is seen
}`;
// What is held is hatched, dark and light, to be seen on pages of both kinds; .held in press.css is its key.
const MARKED = `#version 300 es
precision highp float;
in vec4 tinted; in vec3 still; out vec4 shown;
uniform vec4 rings[3]; uniform vec3 inks[3]; uniform int count;
uniform float held; uniform float doubt; uniform float sharp;
void main() {
  vec3 colour = gl_FrontFacing ? tinted.rgb : vec3(0.73, 0.24, 0.21) * tinted.a;
  if (held > 0.0) {
    float line = abs(fract((gl_FragCoord.x - gl_FragCoord.y) / (9.0 * sharp)) - 0.5) * 9.0;
    colour = mix(vec3(0.25, 0.27, 0.29), vec3(0.8, 0.83, 0.86), clamp(1.4 - line, 0.0, 1.0)) * (0.4 + 0.6 * tinted.a);
  }
  for (int i = 0; i < count; i++) {
    float from = distance(still, rings[i].xyz) - rings[i].w;
    float pixels = abs(from) / (max(fwidth(from), 1e-9) * sharp);
    colour = mix(colour, vec3(0.05), 0.55 * clamp(2.6 - pixels, 0.0, 1.0));
    colour = mix(colour, inks[i], clamp(1.6 - pixels, 0.0, 1.0));
  }
  if (doubt > 0.0) {
    float grey = dot(colour, vec3(0.3, 0.59, 0.11));
    float stripe = smoothstep(0.42, 0.5, abs(fract((gl_FragCoord.x + gl_FragCoord.y) / (13.0 * sharp)) - 0.5) * 2.0);
    colour = vec3(0.36 + 0.42 * grey + 0.16 * (stripe - 0.5));
  }
  shown = vec4(colour, 1.0);
}`;
const PARTS = ["place", "tint", "rest"];

class Painter {
  // an opaque canvas: a browser lays it over nothing, which takes a processor less time
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl2", { antialias: false, alpha: false });
    if (this.gl) this.build();
  }

  build() {
    const { gl } = this;
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    gl.depthFunc(gl.LEQUAL); // marks are drawn again over what they mark
    this.plain = this.program(VERTEX, PLAIN, ["turn", "centre", "scale"]);
    this.marked = this.program(VERTEX, MARKED, ["turn", "centre", "scale", "rings", "inks", "count", "held", "doubt", "sharp"]);
    this.arrows = new Arrows(this);
  }

  program(vertex, fragment, names) {
    return linkProgram(this.gl, vertex, fragment, names, PARTS);
  }

  // buffers for one view of a surface; the triangles from `free` on are held, and hatched
  surface(nodes, triangles, free) {
    const { gl } = this, array = gl.createVertexArray(), buffers = {}, marks = gl.createBuffer(), order = gl.createBuffer();
    gl.bindVertexArray(array);
    PARTS.forEach((name, i) => {
      const bytes = name === "tint";
      buffers[name] = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffers[name]);
      gl.bufferData(gl.ARRAY_BUFFER, name === "rest" ? nodes : (bytes ? 4 : 12) * (nodes.length / 3), gl.DYNAMIC_DRAW);
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, bytes ? 4 : 3, bytes ? gl.UNSIGNED_BYTE : gl.FLOAT, bytes, 0, 0);
    });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, marks);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, 4 * triangles.length, gl.DYNAMIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, order);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, triangles, gl.STATIC_DRAW);
    return { array, buffers, marks, order, free, count: triangles.length };
  }

  send(surface, parts) {
    const { gl } = this;
    for (const [name, data] of Object.entries(parts)) {
      gl.bindBuffer(gl.ARRAY_BUFFER, surface.buffers[name]);
      gl.bufferSubData(gl.ARRAY_BUFFER, 0, data);
    }
  }

  begin() {
    const { backgroundColor } = getComputedStyle(this.canvas); // rgb(245, 247, 248)
    this.gl.clearColor(...backgroundColor.match(/[\d.]+/g).slice(0, 3).map((part) => part / 255), 1);
    this.gl.clear(this.gl.COLOR_BUFFER_BIT | this.gl.DEPTH_BUFFER_BIT);
  }

  // box: x, y, width and height in pixels of the canvas
  // marks: rings [place x, y, z, radius] each, the ink of each, their count, the free triangles that they cross; a doubt
  paint(surface, camera, box, { rings, inks, count, crossed, doubt, sharp }) {
    const { gl, plain, marked } = this, { order, marks, free } = surface;
    gl.viewport(...box);
    gl.bindVertexArray(surface.array);
    gl[surface.open ? "disable" : "enable"](gl.CULL_FACE);
    if (!doubt) this.pass(plain, camera, box, order, 0, free);
    gl.useProgram(marked.program);
    gl.uniform4fv(marked.rings, rings);
    gl.uniform3fv(marked.inks, inks);
    gl.uniform1i(marked.count, count);
    gl.uniform1f(marked.doubt, doubt ? 1 : 0);
    gl.uniform1f(marked.sharp, sharp);
    gl.uniform1f(marked.held, 0);
    if (doubt) this.pass(marked, camera, box, order, 0, free);
    else {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, marks);
      gl.bufferSubData(gl.ELEMENT_ARRAY_BUFFER, 0, crossed.triangles.subarray(0, crossed.count));
      this.pass(marked, camera, box, marks, 0, crossed.count);
    }
    gl.uniform1f(marked.held, 1);
    this.pass(marked, camera, box, order, free, surface.count - free);
    gl.enable(gl.CULL_FACE);
  }

  // some triangles by their numbers in a buffer
  pass(way, camera, box, numbers, from, count) {
    if (!count) return;
    const { gl } = this;
    gl.useProgram(way.program);
    gl.uniformMatrix3fv(way.turn, true, camera.rows.flat());
    gl.uniform3fv(way.centre, camera.centre);
    gl.uniform3fv(way.scale, camera.scale(box[2], box[3]));
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, numbers);
    gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 4 * from);
  }
}

// Unit normals at the nodes of a surface, weighted by area, into `normals`; before they are unit ones into `areas`.
const fillNormals = (places, triangles, normals, areas) => {
  normals.fill(0);
  for (let t = 0; t < triangles.length; t += 3) {
    const i = 3 * triangles[t], j = 3 * triangles[t + 1], k = 3 * triangles[t + 2];
    const ax = places[j] - places[i], ay = places[j + 1] - places[i + 1], az = places[j + 2] - places[i + 2];
    const bx = places[k] - places[i], by = places[k + 1] - places[i + 1], bz = places[k + 2] - places[i + 2];
    const x = ay * bz - az * by, y = az * bx - ax * bz, z = ax * by - ay * bx;
    normals[i] += x; normals[i + 1] += y; normals[i + 2] += z;
    normals[j] += x; normals[j + 1] += y; normals[j + 2] += z;
    normals[k] += x; normals[k + 1] += y; normals[k + 2] += z;
  }
  areas?.set(normals);
  for (let i = 0; i < normals.length; i += 3) {
    const length = Math.sqrt(normals[i] ** 2 + normals[i + 1] ** 2 + normals[i + 2] ** 2) || 1;
    normals[i] /= length; normals[i + 1] /= length; normals[i + 2] /= length;
  }
};
