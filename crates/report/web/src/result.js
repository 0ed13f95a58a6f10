// A result as the page shows it: the table and the corners of the faces.

import { Smoother } from './smooth.js';

/** Columns of patches.csv by name, as they are written: arrays of text. */
export function columns(csv) {
  const lines = csv.split('\n');
  if (lines.at(-1) === '') lines.pop();
  const names = lines[0].split(',');
  const rows = lines.slice(1).map(cells);
  return Object.fromEntries(names.map((name, at) => [name, rows.map((row) => row[at])]));
}

/** The cells of a line; names of surfaces may be quoted. */
function cells(line) {
  if (!line.includes('"')) return line.split(',');
  const found = [];
  for (const [, quoted, plain] of line.matchAll(/(?:^|,)(?:"((?:[^"]|"")*)"|([^,]*))/g)) {
    found.push(quoted === undefined ? plain : quoted.replaceAll('""', '"'));
  }
  return found;
}

/** A number of a mixture as a cell; one that is not known is empty. */
const written = (value) => (Number.isNaN(value) ? '' : String(value));

/** A result: a row a face, and the corners of the faces, with the radiosity there, in the order of rows. */
export class Result {
  constructor(facts, csv, corners, smooth) {
    this.facts = facts;
    this.csv = csv;
    this.corners = corners;
    this.smooth = smooth;
    this.numbers = new Map();
    if (csv !== undefined) {
      this.columns = columns(csv);
      this.size = this.columns.patch.length;
      this.channels = 'radiosity' in this.columns ? [''] : ['_r', '_g', '_b'];
      this.area = this.areas();
    }
    this.sources = null;
    this.sensors = null;
    this.mixed = null;
  }

  /** Whether the page knows a quantity. */
  has(name) {
    return name in this.columns || name + this.channels[0] in this.columns;
  }

  /** The row of a patch that is asked for by its number; −1 where the page has none. */
  rowOf(patch) {
    return this.columns.patch.findIndex((cell) => String(cell) === patch);
  }

  /** Takes the light of a mixture of the sources in place of the table's; `null` goes back to the table. */
  mix(factors) {
    this.halfWidths = null;
    this.mixed = null;
    this.mixedSmooth = null;
    if (factors === null) return;
    const reflectances = this.channels.map((c) => this.number('reflectance' + c));
    this.mixed = this.sources.mix(factors, this.channels, reflectances);
  }

  /** B at the four corners of every face, the channels of a corner side by side. */
  get even() {
    if (this.mixed === null) return this.smooth;
    this.smoother ??= new Smoother(this);
    this.mixedSmooth ??= this.smoother.values();
    return this.mixedSmooth;
  }

  /** A cell of the table as it is written; of a mixture, its number. */
  cell(name, row) {
    return this.mixed?.has(name) ? written(this.mixed.get(name)[row]) : this.columns[name][row];
  }

  /** A column as numbers; empty cells are NaN. */
  number(name) {
    if (this.mixed?.has(name)) return this.mixed.get(name);
    if (!this.numbers.has(name)) {
      const column = this.columns[name];
      this.numbers.set(name, Float64Array.from(column, (cell) => (cell === '' ? NaN : Number(cell))));
    }
    return this.numbers.get(name);
  }

  /** A quantity of every face: of one channel, or its mean over the channels where `channel` is 'mean'. */
  quantity(name, channel) {
    if (this.channels.length === 1) return this.number(name);
    if (channel !== 'mean') return this.number(name + channel);
    const parts = this.channels.map((c) => this.number(name + c));
    return Float64Array.from(parts[0], (_, i) => parts.reduce((sum, part) => sum + part[i], 0) / parts.length);
  }

  /** The quantity whose half-widths are shown: that of the headline; of a net flux its irradiance. */
  get judged() {
    return this.facts.summary.headline.quantity === 'radiosity' ? 'radiosity' : 'irradiance';
  }

  /** What half-widths of each channel are divided by at least: that of the headline; of a mixture 1 % of its mean. */
  floors() {
    if (this.mixed === null) return [this.facts.summary.headline.floor].flat();
    const total = (of) => this.area.reduce((sum, area, i) => sum + area * (of(i) || 0), 0);
    return this.channels.map((channel) => {
      const values = this.number(this.judged + channel);
      return (0.01 * total((i) => values[i])) / total(() => 1);
    });
  }

  /** Half of the interval's width over the estimate or the floor, the largest of the channels, as the headline has it; NaN without an estimate. */
  relativeHalfWidth() {
    if (this.halfWidths) return this.halfWidths;
    this.halfWidths = new Float64Array(this.size).fill(-Infinity);
    const names = this.judged === 'radiosity' ? ['ci_low', 'ci_high', 'radiosity'] : ['irradiance_low', 'irradiance_high', 'irradiance'];
    const floors = this.floors();
    this.channels.forEach((channel, c) => {
      const [low, high, value] = names.map((name) => this.number(name + channel));
      for (let i = 0; i < this.size; i += 1) {
        const width = high[i] === low[i] ? 0 : (high[i] - low[i]) / 2 / Math.max(value[i], floors[c]);
        this.halfWidths[i] = Math.max(this.halfWidths[i], width);
      }
    });
    return this.halfWidths;
  }

  /** Rows with the largest half-widths, at most so many: of patches that walks have hit and that are larger than `least` [m²], each once. */
  worst(count, least) {
    const widths = this.relativeHalfWidth();
    const hits = this.has('hits') ? this.number('hits') : null;
    const [worse, listed] = [(a, b) => widths[b] - widths[a] || a - b, []];
    for (let i = 0; i < this.size; i += 1) {
      if (!Number.isFinite(widths[i]) || (hits !== null && hits[i] <= 0)) continue;
      if (listed.length === count && worse(listed.at(-1), i) <= 0) continue;
      if (this.isOfFace(i - 1, i) || Number(this.cell('area', i)) <= least) continue;
      listed.push(i);
      listed.sort(worse).splice(count);
    }
    return listed;
  }

  /** Whether a row is of the same face as another: the cells of a group are rows of one face. */
  isOfFace(row, other) {
    const { patch, side } = this.columns;
    return row >= 0 && row < this.size && patch[row] === patch[other] && (!side || side.at(row) === side.at(other));
  }

  /** The area of every row as it is drawn [m²]: half the length of the product of its diagonals. A group of cells has several rows. */
  areas() {
    const { corners } = this;
    const areas = new Float64Array(this.size);
    for (let face = 0, at = 0; face < this.size; face += 1, at += 12) {
      const [ux, uy, uz] = [corners[at + 6] - corners[at], corners[at + 7] - corners[at + 1], corners[at + 8] - corners[at + 2]];
      const [vx, vy, vz] = [corners[at + 9] - corners[at + 3], corners[at + 10] - corners[at + 4], corners[at + 11] - corners[at + 5]];
      const [x, y, z] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
      areas[face] = Math.sqrt(x * x + y * y + z * z) / 2;
    }
    return areas;
  }

  /** By face, a number that the faces on one side of a surface share. */
  surfaceSides() {
    const { surface, side } = this.columns;
    const numbers = new Map();
    return Uint32Array.from({ length: this.size }, (_, face) => {
      const key = `${side?.[face] ?? ''}:${surface[face]}`;
      if (!numbers.has(key)) numbers.set(key, numbers.size);
      return numbers.get(key);
    });
  }

  /** Whether a face is a triangle: its fourth corner repeats the third. Cells of sensors are none. */
  isTriangle(face) {
    const { corners } = this;
    if (face >= this.size) return false;
    const at = 12 * face + 6;
    return corners[at] === corners[at + 3] && corners[at + 1] === corners[at + 4] && corners[at + 2] === corners[at + 5];
  }

  /** A corner as [x, y, z] in metres; what is numbered after the last face are the cells of sensors. */
  corner(face, which) {
    const of = face < this.size ? [this.corners, face] : [this.sensors.corners, face - this.size];
    const at = 12 * of[1] + 3 * which;
    return of[0].subarray(at, at + 3);
  }
}
