// Shapes from the page's text: see WebReview.h for how they were written.

const UNKNOWN_DISTANCE = -32768;
const NO_BRANCH = 255;

/** The bytes of a base 64 text. */
function bytesOf(base64) {
  if (Uint8Array.fromBase64) {
    return Uint8Array.fromBase64(base64);
  }
  const binary = atob(base64);
  const bytes = new Uint8Array(binary.length);
  for (let k = 0; k < binary.length; ++k) {
    bytes[k] = binary.charCodeAt(k);
  }
  return bytes;
}

/** A zlib stream, unpacked by the browser. */
async function inflated(bytes) {
  if (typeof DecompressionStream === 'undefined') {
    throw new Error('This browser can not unpack the shapes (it lacks DecompressionStream). ' +
      'Chrome and Edge 80, Firefox 113, Safari 16.4 and later can. The tables are complete.');
  }
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

function unZigZag(value) {
  return (value >>> 1) ^ -(value & 1);
}

/** Indices that were written as differences, in four planes of bytes. */
function readIndices(bytes, place, count) {
  const indices = new Uint32Array(count);
  let last = 0;
  for (let k = 0; k < count; ++k) {
    const at = place + k;
    const value = bytes[at] | bytes[at + count] << 8 | bytes[at + 2 * count] << 16 | bytes[at + 3 * count] << 24;
    last = (last + unZigZag(value)) >>> 0;
    indices[k] = last;
  }
  return indices;
}

/**
 * Numbers of 16 bits that were written as differences from the point before of differences from the phase before.
 * `values` holds the phase before and becomes this one; `stride` numbers a point, of which `components` are written.
 */
function readMoving(bytes, place, values, components, stride) {
  const count = values.length / stride;
  for (let axis = 0; axis < components; ++axis) {
    const low = place + 2 * axis * count;
    const high = low + count;
    let move = 0;
    for (let k = 0; k < count; ++k) {
      move = (move + unZigZag(bytes[low + k] | bytes[high + k] << 8)) & 0xffff;
      values[stride * k + axis] += move;
    }
  }
}

/** A surface, or a tree of lines, over the phases of a case. */
class ShapeSeries {
  constructor(layout, bytes) {
    this.layout = layout;
    this.low = layout.low;
    this.size = layout.step.map((step) => 65535 * step);
    this.distanceStep = layout.distance_step;
    this.branches = layout.branches;
    this.topologies = layout.topologies.map((one) => ({
      points: one.points,
      cells: readIndices(bytes, one.cells, one.indices),
      branchOfPoint: one.branch_of_point === undefined ? null
        : bytes.subarray(one.branch_of_point, one.branch_of_point + one.points),
      labels: one.labels,
    }));
    const positions = this.topologies.map((one) => new Uint16Array(4 * one.points));
    const distances = this.topologies.map((one) => new Uint16Array(one.points));
    this.frames = layout.frames.map((one) => {
      const frame = { topology: this.topologies[one.topology], positions: null, distances: null, normals: null };
      readMoving(bytes, one.positions, positions[one.topology], 3, 4);
      frame.positions = positions[one.topology].slice();
      if (one.distances !== undefined) {
        readMoving(bytes, one.distances, distances[one.topology], 1, 1);
        frame.distances = new Int16Array(distances[one.topology]);
      }
      return frame;
    });
  }

  /** In the phase with the most. */
  get cells() {
    return Math.max(...this.topologies.map((one) => one.cells.length / this.layout.corners));
  }

  position(frame, point) {
    return [0, 1, 2].map((axis) =>
      this.low[axis] + this.layout.step[axis] * frame.positions[4 * point + axis]);
  }

  /** In mm; NaN: not known. */
  distance(frame, point) {
    const number = frame.distances ? frame.distances[point] : UNKNOWN_DISTANCE;
    return number === UNKNOWN_DISTANCE ? NaN : number * this.distanceStep;
  }

  branch(frame, point) {
    const index = frame.topology.branchOfPoint ? frame.topology.branchOfPoint[point] : NO_BRANCH;
    return index === NO_BRANCH ? '' : this.branches[index];
  }

  /** Outward normals of a surface's points, of 16 bits; made when they are asked for first. */
  normals(frame) {
    if (frame.normals) {
      return frame.normals;
    }
    const [sx, sy, sz] = this.layout.step;
    const { positions, topology: { cells, points } } = frame;
    const sums = new Float32Array(3 * points);
    for (let k = 0; k < cells.length; k += 3) {
      const a = 4 * cells[k];
      const b = 4 * cells[k + 1];
      const c = 4 * cells[k + 2];
      const ux = sx * (positions[b] - positions[a]);
      const uy = sy * (positions[b + 1] - positions[a + 1]);
      const uz = sz * (positions[b + 2] - positions[a + 2]);
      const vx = sx * (positions[c] - positions[a]);
      const vy = sy * (positions[c + 1] - positions[a + 1]);
      const vz = sz * (positions[c + 2] - positions[a + 2]);
      const nx = uy * vz - uz * vy;
      const ny = uz * vx - ux * vz;
      const nz = ux * vy - uy * vx;
      for (let corner = 0; corner < 3; ++corner) {
        const at = 3 * cells[k + corner];
        sums[at] += nx;
        sums[at + 1] += ny;
        sums[at + 2] += nz;
      }
    }
    const normals = new Int16Array(4 * points);
    for (let k = 0; k < points; ++k) {
      const length = Math.hypot(sums[3 * k], sums[3 * k + 1], sums[3 * k + 2]) || 1;
      for (let axis = 0; axis < 3; ++axis) {
        normals[4 * k + axis] = Math.round(32767 * sums[3 * k + axis] / length);
      }
    }
    frame.normals = normals;
    return normals;
  }
}

/** The shapes of a case: model, truth and the centerlines of both; null: there are none. */
async function readShapes(layouts, base64) {
  const bytes = await inflated(bytesOf(base64));
  const shapes = {};
  for (const [name, layout] of Object.entries(layouts)) {
    shapes[name] = layout ? new ShapeSeries(layout, bytes) : null;
  }
  return shapes;
}

