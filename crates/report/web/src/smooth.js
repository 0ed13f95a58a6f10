// Radiosity at the corners of faces, for pictures without steps between patches: what the program's `Smooth` does, for light that the
// page makes itself.

/** The cosine of the largest angle between the normals of faces that are one surface to the eye. */
const BEND = 0.94;
/** Differences above this many standard errors are no noise. */
const CERTAIN = 3;
/** Differences below this part of the larger value are steps between patches and not in the light. */
const STEP = 0.35;
/** Corners nearer to each other than this part of the scene's size are one; they are in 32-bit floats. */
const SAME_PLACE = 1e-5;

export class Smoother {
  constructor(result) {
    this.result = result;
    this.normals = Array.from({ length: result.size }, (_, face) => normal(result, face));
    this.reflectance = result.channels.map((c) => result.number('reflectance' + c));
    this.places = places(result);
  }

  /** B at the four corners of every face, the channels of a corner side by side; a triangle's third corner is there twice. */
  values() {
    const { result } = this;
    const of = (name) => result.channels.map((c) => result.number(name + c));
    const [told, errors, low, high, emittance] = ['radiosity', 'std_error', 'ci_low', 'ci_high', 'emittance'].map(of);
    const known = (columns, otherwise) => columns.map((column, c) => column.map((value, i) => (Number.isNaN(value) ? otherwise(c, i) : value)));
    const light = known(told, (c, i) => emittance[c][i]);
    const error = known(errors, (c, i) => (high[c][i] - low[c][i]) / 4);
    const count = result.channels.length;
    const values = new Float32Array(4 * count * result.size);
    for (const touching of this.places.values()) {
      for (const at of touching) {
        const own = at >> 2;
        const sums = new Float64Array(count);
        let area = 0;
        for (const there of touching) {
          const other = there >> 2;
          if (other !== own && !this.goesOn(own, other, light, error, emittance)) continue;
          area += result.area[other];
          for (let c = 0; c < count; c += 1) sums[c] += result.area[other] * light[c][other];
        }
        for (let c = 0; c < count; c += 1) values[count * at + c] = sums[c] / area;
      }
    }
    for (let face = 0; face < result.size; face += 1) {
      const third = (4 * face + 2) * count;
      if (result.isTriangle(face)) values.copyWithin(third + count, third, third + count);
    }
    return values;
  }

  /** Whether another face is the same surface to the eye, in the same light. */
  goesOn(own, other, light, error, emittance) {
    const alike = (columns) => columns.every((column) => column[own] === column[other]);
    const [a, b] = [this.normals[own], this.normals[other]];
    if (a[0] * b[0] + a[1] * b[1] + a[2] * b[2] < BEND || !alike(this.reflectance) || !alike(emittance)) return false;
    return light.every((column, c) => {
      const difference = Math.abs(column[own] - column[other]);
      const certain = difference > CERTAIN * Math.hypot(error[c][own], error[c][other]);
      return !(certain && difference > STEP * Math.max(column[own], column[other]));
    });
  }
}

/** The normal of a face, of length 1. */
function normal(result, face) {
  const [a, b, c] = [0, 1, 2].map((which) => result.corner(face, which));
  const [u, v] = [b, c].map((end) => [0, 1, 2].map((axis) => end[axis] - a[axis]));
  const across = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  const length = Math.hypot(...across);
  return across.map((x) => x / length);
}

/** Corners by place: lists of 4·face + corner. */
function places(result) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  result.corners.forEach((x, at) => {
    low[at % 3] = Math.min(low[at % 3], x);
    high[at % 3] = Math.max(high[at % 3], x);
  });
  const step = SAME_PLACE * Math.max(...low.map((from, axis) => high[axis] - from));
  const steps = 2 + 1 / SAME_PLACE;
  const found = new Map();
  for (let face = 0; face < result.size; face += 1) {
    for (let which = 0; which < (result.isTriangle(face) ? 3 : 4); which += 1) {
      const key = [...result.corner(face, which)].reduce((sum, x, axis) => sum * steps + Math.round((x - low[axis]) / step), 0);
      if (!found.has(key)) found.set(key, []);
      found.get(key).push(4 * face + which);
    }
  }
  return found;
}
