// The sliders of sources: each multiplies what its source emits.

import { element, make } from './elements.js';

/** What a slider reaches, unless the page begins with more. */
const MOST = 2;

export class Dials {
  /** `changed` is called after every change. */
  constructor({ sources: { names, factors } }, changed) {
    this.names = names;
    this.first = factors;
    this.changed = changed;
    this.due = false;
    this.sliders = [];
    this.numbers = [];
    names.forEach((name, s) => element('dials').append(this.row(name, s)));
    element('as-run').addEventListener('click', () => this.set(this.first));
    element('mix').hidden = false;
    this.say();
  }

  /** A slider and a field for the same factor. */
  row(name, s) {
    const most = Math.max(MOST, 2 * this.first[s]);
    const [slider, number] = [
      make('input', '', { type: 'range', id: `dial-${s}`, min: 0, max: most, step: 'any' }),
      make('input', '', { type: 'number', id: `factor-${s}`, min: 0, step: 'any', 'aria-label': `Factor of ${name}` }),
    ];
    for (const input of [slider, number]) input.value = this.first[s];
    slider.addEventListener('keydown', (event) => this.nudge(event, slider, most));
    slider.addEventListener('input', () => { number.value = Number(Number(slider.value).toPrecision(3)); this.change(); });
    number.addEventListener('input', () => { slider.value = number.value; this.change(); });
    this.sliders.push(slider);
    this.numbers.push(number);
    const row = make('div', '', { class: 'row' });
    const label = make('label', `${name} `, { for: slider.id });
    label.append(slider);
    row.append(label, number);
    return row;
  }

  /** Arrow keys move a slider by a hundredth of its range. */
  nudge(event, slider, most) {
    const ways = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 };
    if (!(event.key in ways)) return;
    event.preventDefault();
    slider.value = Number(slider.value) + (ways[event.key] * most) / 100;
    slider.dispatchEvent(new Event('input'));
  }

  set(factors) {
    factors.forEach((factor, s) => {
      this.sliders[s].value = factor;
      this.numbers[s].value = factor;
    });
    this.change();
  }

  /** Factors in the order of the sources; a field that holds no number counts as 0. */
  values() {
    return this.numbers.map(({ value }) => Math.max(Number(value) || 0, 0));
  }

  /** The factors, or `null` where the light is that of the table. */
  factors() {
    const values = this.values();
    return values.every((value, s) => value === this.first[s]) ? null : values;
  }

  /** Tells of a change in the next frame, however many there are until then. */
  change() {
    this.say();
    if (this.due) return;
    this.due = true;
    requestAnimationFrame(() => {
      this.due = false;
      this.changed();
    });
  }

  /** The command that writes the same mixture to a folder. */
  say() {
    const quoted = (name) => (/^[\w.-]+$/.test(name) ? name : `'${name.replaceAll("'", "'\\''")}'`);
    const set = this.values().map((value, s) => ` --set ${quoted(this.names[s])}=${value}`);
    element('combine').textContent = `radwalk combine OUT${set.join('')}`;
  }
}
