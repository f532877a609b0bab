// Where one looks from: a parallel projection, named by the angles of a C-arm. World axes are LPS: x to the patient's
// left, y backwards, z to the head.

const DEGREE = Math.PI / 180;

function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

class Camera {
  constructor() {
    this.leftAnterior = 0;
    this.cranial = 0;
    this.centre = [0, 0, 0];
    this.height = 100; // mm that the picture is high
    this.width = 1;    // pixels, as the page counts them
    this.rows = 1;
  }

  /** The view of a case's pictures, with all of the tree in a picture of this shape. */
  reset(view) {
    const aspect = this.width / this.rows;
    this.leftAnterior = view.left_anterior;
    this.cranial = view.cranial;
    this.centre = view.centre.slice();
    this.height = view.height * Math.max(1, view.aspect / aspect);
  }

  /** What fits into the picture before fits into it after. */
  resize(width, rows, aspect) {
    const needed = () => Math.max(1, aspect * this.rows / this.width);
    this.height /= needed();
    this.width = width;
    this.rows = rows;
    this.height *= needed();
  }

  get axes() {
    const a = this.leftAnterior * DEGREE;
    const c = this.cranial * DEGREE;
    const towards = [Math.sin(a) * Math.cos(c), -Math.cos(a) * Math.cos(c), Math.sin(c)];
    const right = [Math.cos(a), Math.sin(a), 0];
    return { right, up: cross(towards, right), towards };
  }

  get millimetresPerPixel() {
    return this.height / this.rows;
  }

  turn(leftAnterior, cranial) {
    this.leftAnterior = ((this.leftAnterior + leftAnterior + 540) % 360 + 360) % 360 - 180;
    this.cranial = Math.max(-90, Math.min(90, this.cranial + cranial));
  }

  /** Moves the scene by pixels to the right and down. */
  move(right, down) {
    const axes = this.axes;
    for (let k = 0; k < 3; ++k) {
      this.centre[k] += this.millimetresPerPixel * (down * axes.up[k] - right * axes.right[k]);
    }
  }

  /** The point of the picture that is given stays where it is. */
  zoom(factor, x = this.width / 2, y = this.rows / 2) {
    const right = x - this.width / 2;
    const down = y - this.rows / 2;
    const height = Math.max(2, Math.min(2000, this.height / factor));
    const change = this.height / height;
    this.height = height;
    this.move(right * (1 - change), down * (1 - change));
  }

  /** Pixels from the upper left corner, and the depth towards the viewer in mm. */
  project(point) {
    const axes = this.axes;
    const from = [point[0] - this.centre[0], point[1] - this.centre[1], point[2] - this.centre[2]];
    return {
      x: this.width / 2 + dot(from, axes.right) / this.millimetresPerPixel,
      y: this.rows / 2 - dot(from, axes.up) / this.millimetresPerPixel,
      depth: dot(from, axes.towards),
    };
  }

  /** "LAO 30°, CRA 10°", as in the pictures. */
  get name() {
    const part = (angle, positive, negative) =>
      `${angle < 0 ? negative : positive} ${Math.round(Math.abs(angle))}°`;
    const a = Math.round(this.leftAnterior);
    const c = Math.round(this.cranial);
    const side = a === 0 ? 'AP' : Math.abs(a) === 180 ? 'PA' : part(a, 'LAO', 'RAO');
    return c === 0 ? side : `${side}, ${part(c, 'CRA', 'CAU')}`;
  }

  /**
   * The point of a surface under a pixel, or null: the nearest corner of the triangle in front, and where in it.
   */
  pick(series, frame, x, y) {
    const axes = this.axes;
    const step = series.layout.step;
    const scale = 1 / this.millimetresPerPixel;
    const { positions, topology: { cells, points } } = frame;
    const from = series.low.map((low, axis) => low - this.centre[axis]);
    const plane = new Float32Array(3 * points);
    const along = (axis, factor) => [factor * dot(from, axis), ...axis.map((part, k) => factor * part * step[k])];
    const rows = [along(axes.right, scale), along(axes.up, -scale), along(axes.towards, 1)];
    for (let k = 0; k < points; ++k) {
      for (let row = 0; row < 3; ++row) {
        const [start, dx, dy, dz] = rows[row];
        plane[3 * k + row] = start + dx * positions[4 * k] + dy * positions[4 * k + 1] + dz * positions[4 * k + 2];
      }
    }
    const px = x - this.width / 2;
    const py = y - this.rows / 2;
    let best = null;
    for (let k = 0; k < cells.length; k += 3) {
      const a = 3 * cells[k];
      const b = 3 * cells[k + 1];
      const c = 3 * cells[k + 2];
      const area = (plane[b] - plane[a]) * (plane[c + 1] - plane[a + 1]) -
        (plane[c] - plane[a]) * (plane[b + 1] - plane[a + 1]);
      if (area === 0) {
        continue;
      }
      const v = ((px - plane[a]) * (plane[c + 1] - plane[a + 1]) - (plane[c] - plane[a]) * (py - plane[a + 1])) / area;
      const w = ((plane[b] - plane[a]) * (py - plane[a + 1]) - (px - plane[a]) * (plane[b + 1] - plane[a + 1])) / area;
      const u = 1 - v - w;
      if (u < 0 || v < 0 || w < 0) {
        continue;
      }
      const depth = u * plane[a + 2] + v * plane[b + 2] + w * plane[c + 2];
      if (!best || depth > best.depth) {
        const weights = [u, v, w];
        const nearest = weights.indexOf(Math.max(...weights));
        best = { depth, weights, corners: [cells[k], cells[k + 1], cells[k + 2]], point: cells[k + nearest] };
      }
    }
    return best;
  }
}

