// Draws with WebGL 2. Each surface is drawn into a layer of its own, with its depth; the layers are then laid over each
// other in the order of their depth, so that both can be seen through without sorting triangles.

const SURFACE_VERTEX = `#version 300 es
uniform vec3 low, size, centre, right, up, towards, scale;
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in float distance;
out vec3 facing;
out float far;
void main() {
  vec3 from = low + size * position - centre;
  gl_Position = vec4(dot(from, right), dot(from, up), -dot(from, towards), 1.0) * vec4(scale, 1.0);
  facing = vec3(dot(normal, right), dot(normal, up), dot(normal, towards));
  far = distance;
}`;

const SURFACE_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 colour;
uniform float unit; // of a distance's number in ranges; 0: one colour
uniform sampler2D colours;
in vec3 facing;
in float far;
out vec4 shown;
const vec3 LIGHT = vec3(0.15, 0.25, 0.957);
const float UNKNOWN = -32767.5;
void main() {
  vec3 n = normalize(facing);
  n = n.z < 0.0 ? -n : n;
  float lit = max(dot(n, LIGHT), 0.0);
  vec3 base = colour;
  float shine = pow(max(dot(reflect(-LIGHT, n), vec3(0.0, 0.0, 1.0)), 0.0), 24.0);
  if (unit > 0.0) {
    base = far < UNKNOWN ? vec3(0.6) : texture(colours, vec2(0.5 + 0.5 * clamp(far * unit, -1.0, 1.0), 0.5)).rgb;
    shown = vec4(base * (0.45 + 0.58 * lit), 1.0);
  } else {
    shown = vec4(base * (0.28 + 0.76 * lit) + 0.14 * shine, 1.0);
  }
}`;

const WHOLE_VERTEX = `#version 300 es
out vec2 place;
void main() {
  place = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0;
  gl_Position = vec4(2.0 * place - 1.0, 0.0, 1.0);
}`;

const WHOLE_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D firstColour, firstDepth, secondColour, secondDepth;
uniform vec2 opacity;
in vec2 place;
out vec4 shown;
void main() {
  vec4 first = texture(firstColour, place) * opacity.x;
  vec4 second = texture(secondColour, place) * opacity.y;
  bool order = texture(firstDepth, place).r <= texture(secondDepth, place).r;
  vec4 front = order ? first : second;
  vec4 back = order ? second : first;
  shown = front + (1.0 - front.a) * back;
}`;

const LINE_VERTEX = `#version 300 es
uniform vec3 low, size, centre, right, up, scale;
uniform vec2 pixel; // of clip space
uniform float width;
layout(location = 0) in vec3 begin;
layout(location = 1) in vec3 end;
out float across;
vec2 onPicture(vec3 position) {
  vec3 from = low + size * position - centre;
  return vec2(dot(from, right), dot(from, up)) * scale.xy;
}
void main() {
  vec2 a = onPicture(begin);
  vec2 b = onPicture(end);
  vec2 along = (b - a) / pixel;
  along = dot(along, along) > 0.0 ? normalize(along) : vec2(1.0, 0.0);
  across = (gl_VertexID & 1) == 0 ? -1.0 : 1.0;
  vec2 aside = vec2(-along.y, along.x) * across * 0.5 * (width + 2.0) * pixel;
  gl_Position = vec4(((gl_VertexID >> 1) == 0 ? a : b) + aside, 0.0, 1.0);
}`;

const LINE_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 colour;
uniform float width;
in float across;
out vec4 shown;
void main() {
  float inside = clamp(0.5 * width + 0.5 - abs(across) * 0.5 * (width + 2.0), 0.0, 1.0);
  shown = vec4(colour * inside, inside);
}`;

// From inside to outside: blue, nearly white, orange; both ends are as dark.
const COLOURS = [[-1, 33, 60, 150], [-0.5, 92, 146, 214], [0, 236, 235, 228], [0.5, 240, 158, 70], [1, 166, 54, 8]];

/** Red, green and blue of -1 to 1. */
function colourOf(value) {
  const next = Math.max(1, COLOURS.findIndex((one) => value <= one[0]));
  const [from, to] = [COLOURS[next - 1], COLOURS[next]];
  const part = (value - from[0]) / (to[0] - from[0]);
  return [1, 2, 3].map((k) => Math.round(from[k] + part * (to[k] - from[k])));
}

/** What is drawn finely when nothing moves, and how to be quicker while something does. */
const QUALITIES = [{ scale: 1, samples: 4 }, { scale: 1, samples: 0 }, { scale: 0.6, samples: 0 }, { scale: 0.4, samples: 0 }];

class Painter {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = canvas.getContext('webgl2', { alpha: false, antialias: false, depth: false, powerPreference: 'high-performance' });
    if (!gl) {
      throw new Error('This browser offers no WebGL 2, so the model can not be drawn. The tables are complete.');
    }
    this.gl = gl;
    this.surface = this.program(SURFACE_VERTEX, SURFACE_FRAGMENT);
    this.whole = this.program(WHOLE_VERTEX, WHOLE_FRAGMENT);
    this.line = this.program(LINE_VERTEX, LINE_FRAGMENT);
    this.nothing = gl.createVertexArray();
    this.colours = this.colourTexture();
    this.kept = new Map(); // arrays of frames and topologies on the graphics card
    this.layers = new Map();
    this.samples = Math.min(4, gl.getParameter(gl.MAX_SAMPLES));
  }

  program(vertex, fragment) {
    const gl = this.gl;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
      throw new Error(`The drawing program was refused: ${gl.getProgramInfoLog(program)}`);
    }
    const places = {};
    const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) || 0;
    for (let k = 0; k < count; ++k) {
      const name = gl.getActiveUniform(program, k).name;
      places[name] = gl.getUniformLocation(program, name);
    }
    return { program, places };
  }

  colourTexture() {
    const gl = this.gl;
    const pixels = new Uint8Array(4 * 256);
    for (let k = 0; k < 256; ++k) {
      pixels.set([...colourOf(2 * k / 255 - 1), 255], 4 * k);
    }
    const texture = this.texture(gl.LINEAR);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return texture;
  }

  texture(filter) {
    const gl = this.gl;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
      gl.texParameteri(gl.TEXTURE_2D, side, filter);
    }
    for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) {
      gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
    }
    return texture;
  }

  /** Forgets what is on the graphics card of shapes that are no longer shown. */
  clear() {
    for (const made of this.kept.values()) {
      made.buffers.forEach((buffer) => this.gl.deleteBuffer(buffer));
      if (made.array) {
        this.gl.deleteVertexArray(made.array);
      }
    }
    this.kept.clear();
  }

  upload(target, data) {
    const gl = this.gl;
    const buffer = gl.createBuffer();
    gl.bindBuffer(target, buffer);
    gl.bufferData(target, data, gl.STATIC_DRAW);
    return buffer;
  }

  /** A phase of a surface. */
  surfaceOf(series, frame) {
    const known = this.kept.get(frame);
    if (known) {
      return known;
    }
    const gl = this.gl;
    gl.bindVertexArray(null);
    if (!this.kept.has(frame.topology)) {
      this.kept.set(frame.topology, { buffers: [this.upload(gl.ELEMENT_ARRAY_BUFFER, frame.topology.cells)] });
    }
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.kept.get(frame.topology).buffers[0]);
    const buffers = [this.upload(gl.ARRAY_BUFFER, frame.positions)];
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.UNSIGNED_SHORT, true, 8, 0);
    buffers.push(this.upload(gl.ARRAY_BUFFER, series.normals(frame)));
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 3, gl.SHORT, true, 8, 0);
    if (frame.distances) {
      buffers.push(this.upload(gl.ARRAY_BUFFER, frame.distances));
      gl.enableVertexAttribArray(2);
      gl.vertexAttribPointer(2, 1, gl.SHORT, false, 0, 0);
    }
    gl.bindVertexArray(null);
    const made = { array, buffers, count: frame.topology.cells.length };
    this.kept.set(frame, made);
    return made;
  }

  /** A phase of a tree: both ends of every piece. */
  linesOf(frame) {
    const known = this.kept.get(frame);
    if (known) {
      return known;
    }
    const gl = this.gl;
    const { positions, topology: { cells } } = frame;
    const ends = new Uint16Array(4 * cells.length);
    cells.forEach((point, k) => ends.set(positions.subarray(4 * point, 4 * point + 4), 4 * k));
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const buffers = [this.upload(gl.ARRAY_BUFFER, ends)];
    for (const end of [0, 1]) {
      gl.enableVertexAttribArray(end);
      gl.vertexAttribPointer(end, 3, gl.UNSIGNED_SHORT, true, 16, 8 * end);
      gl.vertexAttribDivisor(end, 1);
    }
    gl.bindVertexArray(null);
    const made = { array, buffers, count: cells.length / 2 };
    this.kept.set(frame, made);
    return made;
  }

  /** Two layers of a size: colours and depths, and smoothed where the browser can. */
  layersOf(width, height, samples) {
    const key = `${width} ${height} ${samples}`;
    if (this.layers.has(key)) {
      return this.layers.get(key);
    }
    const gl = this.gl;
    if (this.layers.size > 3) {
      this.dropLayers();
    }
    const buffer = (format) => {
      const made = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, made);
      gl.renderbufferStorageMultisample(gl.RENDERBUFFER, samples, format, width, height);
      return made;
    };
    const pair = [0, 1].map(() => {
      const layer = { colour: this.texture(gl.LINEAR) };
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA8, width, height);
      layer.depth = this.texture(gl.NEAREST);
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, width, height);
      layer.target = gl.createFramebuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, layer.target);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, layer.colour, 0);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, layer.depth, 0);
      layer.fine = null;
      layer.buffers = [];
      if (samples > 0) {
        layer.fine = gl.createFramebuffer();
        layer.buffers = [buffer(gl.RGBA8), buffer(gl.DEPTH_COMPONENT24)];
        gl.bindFramebuffer(gl.FRAMEBUFFER, layer.fine);
        gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, layer.buffers[0]);
        gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, layer.buffers[1]);
      }
      return layer;
    });
    const made = { pair, width, height };
    this.layers.set(key, made);
    return made;
  }

  dropLayers() {
    const gl = this.gl;
    for (const { pair } of this.layers.values()) {
      pair.forEach((layer) => {
        gl.deleteFramebuffer(layer.target);
        gl.deleteFramebuffer(layer.fine);
        layer.buffers.forEach((one) => gl.deleteRenderbuffer(one));
        gl.deleteTexture(layer.colour);
        gl.deleteTexture(layer.depth);
      });
    }
    this.layers.clear();
  }

  use(program, values) {
    const gl = this.gl;
    gl.useProgram(program.program);
    for (const [name, value] of Object.entries(values)) {
      if (typeof value === 'number') {
        gl.uniform1f(program.places[name], value);
      } else {
        gl[`uniform${value.length}fv`](program.places[name], value);
      }
    }
  }

  /**
   * @param surfaces  at most two of { series, frame, colour, opacity, range }; with a range, in mm, coloured by distance
   * @param lines     { series, frame, colour, width } each, over everything; width in the page's pixels, 2 where it is missing
   */
  draw(camera, surfaces, lines, background, quality) {
    const gl = this.gl;
    const { scale, samples } = QUALITIES[quality];
    const width = Math.max(1, Math.round(scale * this.canvas.width));
    const height = Math.max(1, Math.round(scale * this.canvas.height));
    const layers = this.layersOf(width, height, Math.min(samples, this.samples));
    const view = this.viewOf(camera, surfaces);
    gl.viewport(0, 0, width, height);
    layers.pair.forEach((layer, k) => this.drawLayer(layers, layer, view, surfaces[k]));

    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(...background, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.disable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    this.use(this.whole, { opacity: [0, 1].map((k) => (surfaces[k] ? surfaces[k].opacity : 0)) });
    ['firstColour', 'firstDepth', 'secondColour', 'secondDepth'].forEach((name, k) => {
      const layer = layers.pair[k >> 1];
      gl.activeTexture(gl.TEXTURE0 + k);
      gl.bindTexture(gl.TEXTURE_2D, k & 1 ? layer.depth : layer.colour);
      gl.uniform1i(this.whole.places[name], k);
    });
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    lines.forEach((one) => this.drawLines(view, one));
    gl.disable(gl.BLEND);
    gl.bindVertexArray(null);
  }

  viewOf(camera, surfaces) {
    const axes = camera.axes;
    // Everything between the nearest and the furthest depth.
    let reach = 1;
    for (const { series } of surfaces) {
      for (let corner = 0; corner < 8; ++corner) {
        const from = series.low.map((low, k) => low + ((corner >> k) & 1) * series.size[k] - camera.centre[k]);
        reach = Math.max(reach, 1.01 * Math.hypot(...from));
      }
    }
    const y = 2 / camera.height;
    return { centre: camera.centre, right: axes.right, up: axes.up, towards: axes.towards,
      scale: [y * camera.rows / camera.width, y, 1 / reach] };
  }

  drawLayer(layers, layer, view, surface) {
    const gl = this.gl;
    // An empty layer needs no smoothing.
    const fine = surface ? layer.fine : null;
    gl.bindFramebuffer(gl.FRAMEBUFFER, fine || layer.target);
    gl.clearColor(0, 0, 0, 0);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (surface) {
      const { series, frame, colour, range } = surface;
      const made = this.surfaceOf(series, frame);
      gl.enable(gl.DEPTH_TEST);
      gl.disable(gl.BLEND);
      this.use(this.surface, { ...view, low: series.low, size: series.size,
        colour: colour.map((part) => part / 255), unit: range ? series.distanceStep / range : 0 });
      gl.activeTexture(gl.TEXTURE0);
      gl.bindTexture(gl.TEXTURE_2D, this.colours);
      gl.uniform1i(this.surface.places.colours, 0);
      gl.bindVertexArray(made.array);
      gl.drawElements(gl.TRIANGLES, made.count, gl.UNSIGNED_INT, 0);
    }
    if (fine) {
      gl.bindFramebuffer(gl.READ_FRAMEBUFFER, fine);
      gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, layer.target);
      gl.blitFramebuffer(0, 0, layers.width, layers.height, 0, 0, layers.width, layers.height,
        gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT, gl.NEAREST);
    }
  }

  drawLines(view, { series, frame, colour, width = 2 }) {
    const gl = this.gl;
    const made = this.linesOf(frame);
    const ratio = this.canvas.width / Math.max(1, this.canvas.clientWidth);
    this.use(this.line, { centre: view.centre, right: view.right, up: view.up, scale: view.scale,
      low: series.low, size: series.size, colour: colour.map((part) => part / 255), width: width * ratio,
      pixel: [2 / this.canvas.width, 2 / this.canvas.height] });
    gl.bindVertexArray(made.array);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, made.count);
  }
}

