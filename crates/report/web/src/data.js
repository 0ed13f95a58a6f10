// What the page was made from: the summary, the table and the corners of the faces, all inside the page itself.

import { Sources } from './mixture.js';
import { Smoother } from './smooth.js';

/** Text of an element that holds data. */
const text = (page, id) => page.getElementById(id).textContent;

/** Bytes of an element that holds base64 of a zlib stream. */
async function inflate(page, id) {
  const packed = Uint8Array.from(atob(text(page, id)), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Response(stream).arrayBuffer();
}

/** Columns of patches.csv by name, as they are written: arrays of text. */
function columns(csv) {
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

/** Everything a page shows. News of a run come without corners: those of the result that its first page showed stay. */
export async function load(page, known = null) {
  const facts = JSON.parse(text(page, 'facts'));
  const [table, smooth] = await Promise.all(['table', 'smooth'].map((id) => inflate(page, id)));
  const corners = known?.corners ?? new Float32Array(await inflate(page, 'corners'));
  const result = new Result(facts, new TextDecoder().decode(table), corners, new Float32Array(smooth));
  if (facts.dials) result.sources = new Sources(facts.dials, new Float64Array(await inflate(page, 'scores')), result.size);
  if (page.getElementById('sensor-table')) {
    const read = new TextDecoder().decode(await inflate(page, 'sensor-table'));
    const places = known?.sensors?.corners ?? new Float32Array(await inflate(page, 'sensor-corners'));
    result.sensors = { columns: columns(read), corners: places, size: places.length / 12 };
  }
  return result;
}

/** A result: a row a face, and the corners of the faces, with the radiosity there, in the order of rows. */
export class Result {
  constructor(facts, csv, corners, smooth) {
    this.facts = facts;
    this.csv = csv;
    this.corners = corners;
    this.smooth = smooth;
    this.columns = columns(csv);
    this.size = this.columns.patch.length;
    this.channels = 'radiosity' in this.columns ? [''] : ['_r', '_g', '_b'];
    this.numbers = new Map();
    this.area = this.number('area');
    this.sources = null;
    this.sensors = null;
    this.mixed = null;
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

  /** Half of the interval's width over the estimate, the largest of the channels. */
  relativeHalfWidth() {
    this.halfWidths ??= Float64Array.from(this.area, (_, i) => {
      const of = (c) => {
        const [low, high, value] = ['ci_low', 'ci_high', 'radiosity'].map((name) => this.number(name + c)[i]);
        return value === 0 && high === low ? 0 : (high - low) / 2 / value;
      };
      return Math.max(...this.channels.map(of));
    });
    return this.halfWidths;
  }

  /** Whether a face is a triangle: its fourth corner repeats the third. */
  isTriangle(face) {
    const [third, fourth] = [this.corner(face, 2), this.corner(face, 3)];
    return [0, 1, 2].every((axis) => third[axis] === fourth[axis]);
  }

  /** A corner as [x, y, z] in metres; what is numbered after the last face are the cells of sensors. */
  corner(face, which) {
    const of = face < this.size ? [this.corners, face] : [this.sensors.corners, face - this.size];
    const at = 12 * of[1] + 3 * which;
    return of[0].subarray(at, at + 3);
  }
}
