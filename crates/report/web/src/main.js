// The part of the page that moves: the view, what it shows, and the numbers of one face.

import { gradient, UNKNOWN } from './colours.js';
import { load } from './data.js';
import { Dials } from './dials.js';
import { element, make } from './elements.js';
import { drawing, histogram } from './histogram.js';
import { quantities, shade } from './shades.js';
import { View } from './view.js';

/** Faces with less than this part of the area are not listed among the worst. */
const TINY = 1e-6;
/** Rows of the list of the worst. */
const LISTED = 20;
/** Half-widths beyond this say no more than that nothing is known. */
const BEYOND = 10;
/** Above this many cells sensors are not drawn until asked for. */
const CELLS_UP_TO = 50;
/** Above this many faces the edges of patches are not drawn until asked for. */
const GRID_UP_TO = 400;

/** Parts of the page that a run changes. */
const PARTS = ['head', 'maps', 'known', 'planes', 'sensors', 'sources', 'sensitivities', 'checks', 'energy', 'model', 'origin'];
/** Between two questions for news, and where the page is not in sight [ms]. */
const PAUSES = { visible: 2000, hidden: 15000 };
/** Questions without an answer after which the run is over. */
const PATIENCE = 3;

class Page {
  constructor(result, view) {
    this.result = result;
    this.view = view;
    this.pinned = null;
    this.choices = quantities(result);
    for (const { key, label } of this.choices) element('quantity').append(make('option', label, { value: key }));
    const channels = result.channels.length === 1 ? [['mean', 'the one channel']] : [['mean', 'mean of the channels'], ['_r', 'red'], ['_g', 'green'], ['_b', 'blue']];
    for (const [value, label] of channels) element('channel').append(make('option', label, { value }));
    element('channel-row').hidden = channels.length === 1;
    element('grid').checked = result.size <= GRID_UP_TO;
    view.showGrid(element('grid').checked);
    element('save').hidden = result.csv === undefined;
    element('marks-row').hidden = result.sensors === null;
    if (result.sensors !== null) this.markSensors();
    this.dials = result.sources === null ? null : new Dials(result, () => this.remix());
    this.listWorst();
    this.listen();
    this.recolour();
  }

  /** Shows sensors at first where they are few, and not planes of points alone. */
  markSensors() {
    const { facts: { summary }, sensors: { size } } = this.result;
    const onPlanes = (summary.planes ?? []).reduce((sum, plane) => sum + plane.points, 0);
    element('marks').checked = size <= CELLS_UP_TO && onPlanes < size;
    this.view.showSensors(element('marks').checked);
  }

  listen() {
    for (const id of ['quantity', 'channel', 'logarithmic', 'even']) element(id).addEventListener('change', () => this.recolour());
    element('exposure').addEventListener('input', () => this.recolour());
    element('grid').addEventListener('change', () => this.view.showGrid(element('grid').checked));
    element('marks').addEventListener('change', () => this.view.showSensors(element('marks').checked));
    for (const id of ['axis', 'part', 'flip']) element(id).addEventListener('input', () => this.cut());
    element('home').addEventListener('click', () => this.view.home());
    for (const { name, ...view } of this.result.facts.summary.views ?? []) {
      const button = make('button', name, { type: 'button' });
      button.addEventListener('click', () => this.view.stand(view));
      element('views').append(button);
    }
    for (const [id, across, ahead] of [['step-ahead', 0, 1], ['step-back', 0, -1], ['step-left', -1, 0], ['step-right', 1, 0]]) {
      element(id).addEventListener('click', () => this.view.walk(across, ahead));
    }
    element('find').addEventListener('submit', (event) => {
      event.preventDefault();
      const row = this.result.rowOf(element('number').value.trim());
      if (row < 0) element('numbers').textContent = `There is no patch ${element('number').value} in this page.`;
      else this.pin(row, true);
    });
    // Its part of the page is replaced while a run goes on.
    document.addEventListener('click', (event) => { if (event.target.id === 'save') this.save(); });
    this.listenToPointer();
    element('view').addEventListener('keydown', (event) => this.key(event));
  }

  listenToPointer() {
    const canvas = element('view');
    let asked = null;
    let pressed = null;
    canvas.addEventListener('pointermove', (event) => {
      if (event.buttons !== 0 || this.pinned !== null) return;
      if (asked === null) {
        requestAnimationFrame(() => {
          const face = this.view.faceAt(...asked);
          asked = null;
          this.view.select(face);
          this.tell(face);
        });
      }
      asked = [event.clientX, event.clientY];
    });
    canvas.addEventListener('pointerdown', (event) => { pressed = [event.clientX, event.clientY]; });
    canvas.addEventListener('pointerup', (event) => {
      const moved = pressed === null ? Infinity : Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]);
      if (moved > 5) return;
      const face = this.view.faceAt(event.clientX, event.clientY);
      this.pin(face === this.pinned ? null : face, false);
    });
  }

  key(event) {
    const turn = Math.PI / 36;
    const ways = {
      ArrowLeft: () => this.view.turn(turn, 0), ArrowRight: () => this.view.turn(-turn, 0),
      ArrowUp: () => this.view.turn(0, -turn), ArrowDown: () => this.view.turn(0, turn),
      '+': () => this.view.turn(0, 0, 1.1), '=': () => this.view.turn(0, 0, 1.1), '-': () => this.view.turn(0, 0, 1 / 1.1),
      w: () => this.view.walk(0, 1), s: () => this.view.walk(0, -1), a: () => this.view.walk(-1, 0), d: () => this.view.walk(1, 0),
      Home: () => this.view.home(), Escape: () => this.pin(null, false),
      n: () => this.step(1), p: () => this.step(-1),
    };
    if (event.ctrlKey || event.metaKey || event.altKey || !(event.key in ways)) return;
    event.preventDefault();
    ways[event.key]();
  }

  /** The next face or cell of a sensor, or the one before. */
  step(by) {
    const size = this.result.size + (this.result.sensors?.size ?? 0);
    this.pin(((this.pinned ?? (by > 0 ? -1 : 0)) + by + size) % size, false);
  }

  /** Shows the light of the sources as they are set now. */
  remix() {
    this.result.mix(this.dials.factors());
    this.listWorst();
    this.recolour();
    this.tell(this.pinned);
  }

  recolour() {
    const quantity = this.choices.find(({ key }) => key === element('quantity').value);
    const settings = {
      quantity, channel: element('channel').value, logarithmic: element('logarithmic').checked, stops: Number(element('exposure').value), even: element('even').checked,
    };
    const plain = quantity.picture || quantity.flags;
    element('logarithmic-row').hidden = plain;
    element('exposure-row').hidden = !quantity.picture;
    element('even-row').hidden = !quantity.picture;
    element('channel-row').hidden = plain || this.result.channels.length === 1 || ['half_width', 'hits'].includes(quantity.key);
    element('exposure-words').textContent = `${settings.stops >= 0 ? '+' : '−'}${Math.abs(settings.stops).toFixed(1)} stops`;
    const { bytes, legend, range } = shade(this.result, settings);
    this.view.colour(bytes);
    this.explain(quantity, legend);
    this.range = range ?? null;
    this.count();
  }

  /** Shows how much of the area has how much of the quantity: of the surface whose patch is kept, else of all. */
  count() {
    element('histogram').hidden = this.range === null;
    if (this.range === null) return;
    const { result, range, pinned } = this;
    const surface = (face) => result.cell('surface', face);
    const one = pinned !== null && pinned < result.size && result.has('surface') ? surface(pinned) : null;
    const parts = histogram(range.values, result.area, range, one === null ? undefined : (face) => surface(face) === one);
    element('bars').innerHTML = drawing(parts);
    element('counted').textContent = one === null ? `Parts of the area of all patches.${result.has('surface') ? ' Keep a patch to see those of its surface.' : ''}` : `Parts of the area of ${one}.`;
  }

  explain(quantity, { words, entries, ticks, unknown }) {
    const legend = element('legend');
    legend.replaceChildren(make('strong', quantity.label));
    if (words) legend.append(make('p', words));
    if (ticks) {
      const bar = make('div', '', { class: 'scale', style: `background: ${gradient}` });
      const row = make('div', '', { class: 'ticks' });
      ticks.forEach((tick) => row.append(make('span', tick)));
      legend.append(bar, row);
    }
    const swatches = [...(entries ?? [])];
    if (unknown) swatches.push({ colour: UNKNOWN, words: unknown });
    for (const { colour, words: meaning } of swatches) {
      const line = make('p', '', { class: 'swatch' });
      line.append(make('span', '', { style: `background: rgb(${colour})` }), meaning);
      legend.append(line);
    }
  }

  cut() {
    const chosen = element('axis').value;
    element('part-row').hidden = chosen === '';
    this.view.cut(chosen === '' ? null : Number(chosen), Number(element('part').value), element('flip').checked);
  }

  /** Keeps the numbers of a face on the page; `null` lets go of them. */
  pin(face, fly) {
    this.pinned = face;
    this.count();
    if (fly) this.view.flyTo(face);
    else this.view.select(face);
    this.tell(face);
  }

  /** Writes the numbers of a face, as patches.csv has them. */
  tell(face) {
    const { columns, channels, mixed, size } = this.result;
    const shown = element('numbers');
    if (face === null) {
      shown.replaceChildren(make('p', 'Point at a patch, or tap it, to read its numbers.'));
      return;
    }
    if (face >= size) {
      this.tellSensor(face - size);
      return;
    }
    const cell = (name) => this.result.cell(name, face);
    const known = (...names) => names.every((name) => this.result.has(name));
    const all = (name) => channels.map((channel) => cell(name + channel) || 'unknown').join('\n');
    const { radiosity: light, irradiance: flux } = this.result.facts.summary.units;
    const percent = (this.result.facts.summary.confidence * 100).toPrecision(4) * 1;
    const side = columns.side ? `, ${cell('side')}` : '';
    const rows = [
      ['Patch', `${cell('patch')}${side}${known('surface') ? `: ${cell('surface')} [${cell('u')}, ${cell('v')}]` : ''}`],
      [`Radiosity [${light}]`, all('radiosity')],
      [`${percent} % interval`, channels.map((c) => (cell(`ci_low${c}`) === '' ? 'unknown' : `${cell(`ci_low${c}`)} … ${cell(`ci_high${c}`)}`)).join('\n')],
      ...(known('std_error') ? [['Standard error', all('std_error')]] : []),
      [`Irradiance [${flux}]`, all('irradiance')],
      ...(known('irradiance_error') ? [['Its standard error', all('irradiance_error')]] : []),
      ['Reflectance', all('reflectance')],
      [`Emittance [${light}]`, all('emittance')],
      ['Area [m²]', cell('area')],
      ['Centroid [m]', ['x', 'y', 'z'].map(cell).join(', ')],
      // Hits and flags are those of all sources together.
      ...(mixed || !known('hits') ? [] : [['Hits', cell('hits')], ['Flags', cell('flags').replaceAll('|', ', ') || 'none']]),
    ];
    shown.replaceChildren(list(rows));
  }

  /** Writes what a cell of a sensor reads, as sensors.csv has it. */
  tellSensor(number) {
    const { channels, sensors: { columns } } = this.result;
    const cell = (name) => columns[name][number];
    const { summary: { units, confidence } } = this.result.facts;
    const rows = [
      ['Sensor', `${cell('sensor')} [${cell('u')}, ${cell('v')}]`],
      [`Irradiance [${units.irradiance}]`, channels.map((c) => cell(`irradiance${c}`) || 'unknown').join('\n')],
      [`${(confidence * 100).toPrecision(4) * 1} % interval`, channels.map((c) => `${cell(`ci_low${c}`)} … ${cell(`ci_high${c}`)}`).join('\n')],
      ['Standard error', channels.map((c) => cell(`std_error${c}`) || 'unknown').join('\n')],
      ['Middle [m]', ['x', 'y', 'z'].map(cell).join(', ')],
    ];
    element('numbers').replaceChildren(list(rows));
  }

  listWorst() {
    const { result } = this;
    const widths = result.relativeHalfWidth();
    const percent = (width) => (width > BEYOND ? `beyond ${100 * BEYOND} %` : `${(100 * width).toPrecision(3)} %`);
    const listed = result.worst(LISTED, TINY * result.area.reduce((sum, area) => sum + area, 0));
    const body = element('worst');
    body.replaceChildren();
    for (const face of listed) {
      const row = make('tr');
      const side = result.columns.side ? `, ${result.cell('side', face)}` : '';
      const button = make('button', result.cell('patch', face) + side, { type: 'button' });
      button.addEventListener('click', () => {
        this.pin(face, true);
        element('view').scrollIntoView({ block: 'nearest' });
      });
      const first = make('td');
      first.append(button);
      row.append(first, make('td', result.has('surface') ? result.cell('surface', face) : ''), make('td', percent(widths[face])), make('td', result.has('hits') ? result.cell('hits', face) : ''));
      body.append(row);
    }
  }

  /** Shows what a later page of the same run has, from where one looks now. */
  renew(page, result) {
    this.result = result;
    this.view.renew(result);
    this.choices = quantities(result);
    for (const id of PARTS) {
      const part = element(id);
      // A page without sensors has no such part.
      if (part === null) continue;
      // What is being read by keyboard stays until it is left.
      if (!part.contains(document.activeElement)) part.replaceChildren(...page.getElementById(id).childNodes);
    }
    if (this.dials !== null) result.mix(this.dials.factors());
    if (!element('known').contains(document.activeElement)) this.listWorst();
    this.recolour();
    this.tell(this.pinned);
  }

  /** Gives the table that is in the page as a file. */
  save() {
    const link = make('a', '', { download: 'patches.csv', href: URL.createObjectURL(new Blob([this.result.csv], { type: 'text/csv' })) });
    link.click();
    URL.revokeObjectURL(link.href);
  }
}

/** Names and values, side by side. */
function list(rows) {
  const made = make('dl');
  for (const [name, value] of rows) made.append(make('dt', name), make('dd', value));
  return made;
}

/** Follows a run until it cannot be reached. */
async function follow(page) {
  const live = element('live');
  let [tag, missed] = [null, 0];
  while (missed < PATIENCE) {
    await new Promise((done) => { setTimeout(done, PAUSES[document.visibilityState] ?? PAUSES.hidden); });
    try {
      const answer = await fetch(`news${window.location.search}`, { cache: 'no-store', headers: tag ? { 'If-None-Match': tag } : {} });
      if (!answer.ok && answer.status !== 304) throw new Error(answer.statusText);
      missed = 0;
      if (answer.status === 304) continue;
      const news = new DOMParser().parseFromString(await answer.text(), 'text/html');
      page.renew(news, await load(news, page.result));
      tag = answer.headers.get('etag');
      live.textContent = `${news.getElementById('live').textContent} As of ${new Date().toLocaleTimeString()}.`;
    } catch {
      missed += 1;
    }
  }
  live.textContent = 'The run has ended, or cannot be reached: this is the last that was heard of it.';
}

try {
  const result = await load(document);
  const page = new Page(result, new View(element('view'), result));
  page.tell(null);
  element('loading').remove();
  document.documentElement.dataset.ready = 'yes';
  // For scripts that look at the page.
  window.radwalk = page;
  if (result.facts.live) follow(page);
} catch (fault) {
  element('loading').textContent = `The scene cannot be shown: ${fault.message}. The numbers below are complete without it; a browser with WebGL shows it.`;
  document.documentElement.dataset.ready = 'no';
}
