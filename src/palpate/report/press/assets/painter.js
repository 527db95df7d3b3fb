// The surface drawn with WebGL: buffers are made once, and only places, normals and shades are sent anew.
// Light and colour are worked out at the nodes, which is cheap where a processor has to do what a graphics card would.
const VERTEX = `#version 300 es
in vec3 place; in vec3 normal; in vec3 rest; in float shade; in float held;
uniform mat3 turn; uniform vec3 centre; uniform vec3 scale; uniform sampler2D palette;
out vec3 tint; out vec3 still; out vec2 fixedTo;
void main() {
  vec3 n = turn * normal;
  vec3 colour = textureLod(palette, vec2(clamp(shade, 0.002, 0.998), 0.5), 0.0).rgb;
  if (shade < 0.0) colour = vec3(0.72, 0.75, 0.78);
  float light = 0.44 + 0.50 * max(dot(n, vec3(-0.350, 0.550, 0.758)), 0.0) + 0.14 * n.z;
  float gloss = 0.14 * pow(max(dot(n, vec3(-0.206, 0.371, 0.906)), 0.0), 24.0);
  tint = colour * light + gloss; still = rest; fixedTo = vec2(held, light);
  gl_Position = vec4(turn * (place - centre) * scale * vec3(1.0, 1.0, -1.0), 1.0);
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 tint; in vec3 still; in vec2 fixedTo; out vec4 shown;
uniform vec4 rings[3]; uniform vec3 inks[3]; uniform int count;
uniform float doubt; uniform float sharp;
void main() {
  vec3 colour = fixedTo.x > 0.995 ? vec3(0.27, 0.29, 0.31) * fixedTo.y : tint;
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
const PARTS = { place: 3, normal: 3, rest: 3, shade: 1, held: 1 };

class Painter {
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl2", { antialias: false, alpha: true });
    if (this.gl) this.build();
  }

  build() {
    const { gl } = this, program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    gl.useProgram(program);
    gl.enable(gl.DEPTH_TEST);
    const names = ["turn", "centre", "scale", "rings", "inks", "count", "doubt", "sharp"];
    this.uniforms = Object.fromEntries(names.map((name) => [name, gl.getUniformLocation(program, name)]));
    this.where = Object.fromEntries(Object.keys(PARTS).map((name) => [name, gl.getAttribLocation(program, name)]));
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
    for (const size of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, size, gl.LINEAR);
  }

  // buffers for one view of a surface
  surface(count, triangles) {
    const { gl } = this, array = gl.createVertexArray(), buffers = {};
    gl.bindVertexArray(array);
    for (const [name, width] of Object.entries(PARTS)) {
      buffers[name] = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffers[name]);
      gl.bufferData(gl.ARRAY_BUFFER, 4 * width * count, gl.DYNAMIC_DRAW);
      gl.enableVertexAttribArray(this.where[name]);
      gl.vertexAttribPointer(this.where[name], width, gl.FLOAT, false, 0, 0);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, triangles, gl.STATIC_DRAW);
    return { array, buffers, count: triangles.length };
  }

  send(surface, parts) {
    const { gl } = this;
    for (const [name, data] of Object.entries(parts)) {
      gl.bindBuffer(gl.ARRAY_BUFFER, surface.buffers[name]);
      gl.bufferSubData(gl.ARRAY_BUFFER, 0, data);
    }
  }

  // the colours that shades from 0 to 1 have, three bytes each
  colour(palette) {
    if (this.palette === palette) return;
    const { gl } = this;
    this.palette = palette;
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, palette.length / 3, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, palette);
  }

  begin() {
    this.gl.clearColor(0, 0, 0, 0);
    this.gl.clear(this.gl.COLOR_BUFFER_BIT | this.gl.DEPTH_BUFFER_BIT);
  }

  // rings: [place x, y, z, radius] each, with the ink of each; box: x, y, width and height in pixels of the canvas
  paint(surface, camera, box, { rings, inks, count, doubt, sharp }) {
    const { gl, uniforms } = this;
    gl.viewport(...box);
    gl.uniformMatrix3fv(uniforms.turn, true, camera.rows.flat());
    gl.uniform3fv(uniforms.centre, camera.centre);
    gl.uniform3fv(uniforms.scale, camera.scale(box[2], box[3]));
    gl.uniform4fv(uniforms.rings, rings);
    gl.uniform3fv(uniforms.inks, inks);
    gl.uniform1i(uniforms.count, count);
    gl.uniform1f(uniforms.doubt, doubt ? 1 : 0);
    gl.uniform1f(uniforms.sharp, sharp);
    gl.bindVertexArray(surface.array);
    gl.drawElements(gl.TRIANGLES, surface.count, gl.UNSIGNED_INT, 0);
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
