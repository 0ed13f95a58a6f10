// Results of many patches: corners on a grid, which faces share, and rounded numbers, as `page/compact.rs` of the program packs them.

import { Result } from './result.js';

/** Reads planes of numbers one after the other. */
class Planes {
  constructor(buffer) {
    this.bytes = new Uint8Array(buffer);
    this.at = 0;
  }

  eight(count) {
    this.at += count;
    return this.bytes.subarray(this.at - count, this.at);
  }

  /** Numbers of 16 bits: differences, the low bytes of all before the high ones. */
  sixteen(count) {
    const [low, high] = [this.eight(count), this.eight(count)];
    const numbers = new Uint16Array(count);
    let sum = 0;
    for (let i = 0; i < count; i += 1) {
      sum = (sum + low[i] + (high[i] << 8)) & 0xffff;
      numbers[i] = sum;
    }
    return numbers;
  }

  /** Numbers of 32 bits, byte by byte of all. */
  thirtyTwo(count) {
    const [a, b, c, d] = [0, 1, 2, 3].map(() => this.eight(count));
    const numbers = new Uint32Array(count);
    for (let i = 0; i < count; i += 1) numbers[i] = a[i] | (b[i] << 8) | (c[i] << 16) | (d[i] << 24);
    return numbers;
  }
}

/** The entry of a table for each code. */
function looked(codes, table) {
  const found = new Float32Array(codes.length);
  for (let at = 0; at < codes.length; at += 1) found[at] = table[codes[at]];
  return found;
}

/** What reads codes as logarithms: 0 is unknown, 1 is 0. */
function decoder(least, steps) {
  const values = new Float32Array(65536);
  for (let code = 2; code < 65536; code += 1) values[code] = 2 ** (least + (code - 2) / steps);
  values[0] = NaN;
  return (codes) => looked(codes, values);
}

export class CompactResult extends Result {
  constructor(facts, buffer) {
    super(facts);
    const { rows, vertices, low, step, materials, least, steps, seen_steps: seenSteps, width_steps: widthSteps, ends, channels: count } = facts.compact;
    this.size = rows;
    this.channels = count === 1 ? [''] : ['_r', '_g', '_b'];
    const planes = new Planes(buffer);
    const places = [0, 1, 2].map(() => planes.sixteen(vertices));
    const seen = decoder(least, seenSteps);
    const lights = this.channels.map(() => seen(planes.sixteen(vertices)));
    const back = [0, 1, 2, 3].map(() => planes.thirtyTwo(rows));
    this.corners = new Float32Array(12 * rows);
    this.smooth = new Float32Array(4 * count * rows);
    for (let at = 0, met = 0; at < 4 * rows; at += 1) {
      const vertex = met - back[at & 3][at >> 2];
      if (vertex === met) met += 1;
      for (let axis = 0; axis < 3; axis += 1) this.corners[3 * at + axis] = low[axis] + step * places[axis][vertex];
      for (let c = 0; c < count; c += 1) this.smooth[count * at + c] = lights[c][vertex];
    }
    this.patches = planes.thirtyTwo(rows);
    for (let row = 1; row < rows; row += 1) this.patches[row] += this.patches[row - 1];
    this.sides = planes.eight(rows);
    const material = planes.sixteen(rows);
    const values = decoder(least, steps);
    for (const name of ends ? ['radiosity', 'ci_low', 'ci_high'] : ['radiosity']) {
      for (const channel of this.channels) this.numbers.set(name + channel, values(planes.sixteen(rows)));
    }
    if (!ends) {
      const width = Float32Array.from({ length: 256 }, (_, code) => (code === 0 ? NaN : 2 ** ((code - 1) / widthSteps - 15)));
      this.widths = looked(planes.eight(rows), width);
    }
    this.channels.forEach((channel, c) => {
      const of = (first) => looked(material, materials.map((numbers) => numbers[first + c]));
      this.numbers.set('reflectance' + channel, of(0));
      this.numbers.set('emittance' + channel, of(count));
      const [reflectance, emittance, radiosity] = ['reflectance', 'emittance', 'radiosity'].map((name) => this.numbers.get(name + channel));
      const irradiance = new Float32Array(rows);
      const told = values(planes.sixteen(rows));
      // H = (B − E)/ϱ, where the difference is no rounding.
      for (let i = 0; i < rows; i += 1) irradiance[i] = emittance[i] === 0 && reflectance[i] > 0 ? radiosity[i] / reflectance[i] : told[i];
      this.numbers.set('irradiance' + channel, irradiance);
    });
    this.area = this.areas();
    this.columns = { patch: this.patches };
    if (facts.compact.two_sided) this.columns.side = { at: (row) => (this.sides[row] === 1 ? 'back' : 'front') };
  }

  /** Such a page does not know the surfaces: each face is one. */
  surfaceSides() {
    return Uint32Array.from({ length: this.size }, (_, face) => face);
  }

  has(name) {
    return this.numbers.has(name + this.channels[0]);
  }

  number(name) {
    if (!this.numbers.has(name)) this.numbers.set(name, this.end(name));
    return this.numbers.get(name);
  }

  /** An end of the intervals of B or H, where the page does not hold it; of H unknown of rows that emit or are black. */
  end(name) {
    const [, quantity, end, channel] = name.match(/^(ci|irradiance)_(low|high)(.*)$/);
    const [reflectance, emittance, radiosity] = ['reflectance', 'emittance', 'radiosity'].map((of) => this.numbers.get(of + channel));
    const sign = end === 'low' ? -1 : 1;
    if (quantity === 'ci') return radiosity.map((value, i) => value * Math.max(1 + sign * this.widths[i], 0));
    return this.number(`ci_${end}${channel}`).map((value, i) => (emittance[i] === 0 && reflectance[i] > 0 ? value / reflectance[i] : NaN));
  }

  /** The rows of a face, from the first to before the last: several of a group of cells. */
  rowsOf(row) {
    let [from, to] = [row, row + 1];
    while (this.isOfFace(from - 1, row)) from -= 1;
    while (this.isOfFace(to, row)) to += 1;
    return Array.from({ length: to - from }, (_, i) => from + i);
  }

  /** A coordinate of the middle of a row. */
  middle(row, axis) {
    const count = this.isTriangle(row) ? 3 : 4;
    return [0, 1, 2, 3].slice(0, count).reduce((total, which) => total + this.corner(row, which)[axis], 0) / count;
  }

  cell(name, row) {
    if (name === 'patch') return String(this.patches[row]);
    if (name === 'side') return this.sides[row] === 1 ? 'back' : 'front';
    const total = (of) => this.rowsOf(row).reduce((sum, i) => sum + this.area[i] * of(i), 0);
    if (name === 'area') return String(Number(total(() => 1).toPrecision(4)));
    const axis = ['x', 'y', 'z'].indexOf(name);
    if (axis >= 0) return String(Number((total((i) => this.middle(i, axis)) / total(() => 1)).toPrecision(5)));
    const value = this.number(name)[row];
    return Number.isNaN(value) ? '' : String(Number(value.toPrecision(4)));
  }
}
