// What the page makes of its data is what the program says: mixtures of sources, and light between patches.
//
//     PAGES=FOLDER node --test crates/report/web/test        as scripts/test-page.sh does it
//
// FOLDER holds `run`, the result of configs/lamps.toml, `mix`, what `radwalk combine` makes of it with FACTORS, and `dark`, where one
// source alone emits; each with its report.html. `many` has a page of rounded numbers.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import test from 'node:test';

import { bend } from '../src/colours.js';
import { CompactResult } from '../src/compact.js';
import { load } from '../src/data.js';
import { histogram } from '../src/histogram.js';
import { columns } from '../src/result.js';
import { quantities, shade } from '../src/shades.js';

const FOLDER = process.env.PAGES;
const COLUMNS = ['emittance', 'radiosity', 'std_error', 'ci_low', 'ci_high', 'irradiance', 'irradiance_error'];
const FACTORS = { mix: [0.3, 1.7, 1], dark: [0, 1.5, 0] };

/** The data of a page, found as a browser finds it. */
function open(name) {
  const html = readFileSync(join(FOLDER, name, 'report.html'), 'utf8');
  const element = (id) => html.match(new RegExp(`<script [^>]*id="${id}">([^<]*)</script>`));
  return load({ getElementById: (id) => { const found = element(id); return found && { textContent: found[1] }; } });
}

/** Holds columns of a result against those of another, each relative to its largest number. */
function assertSame(result, other, names) {
  for (const name of names) {
    for (const channel of result.channels) {
      const [told, truth] = [result.number(name + channel), other.number(name + channel)];
      assert.equal(told.length, truth.length);
      const most = truth.reduce((largest, value) => Math.max(largest, Math.abs(value)), 0);
      told.forEach((value, i) => {
        const same = Number.isNaN(truth[i]) ? Number.isNaN(value) : Math.abs(value - truth[i]) <= 1e-9 * most;
        assert.ok(same, `${name}${channel} of row ${i}: ${value}, not ${truth[i]}`);
      });
    }
  }
}

for (const [name, factors] of Object.entries(FACTORS)) {
  test(`sliders at ${factors} show what combine writes`, async () => {
    const [run, mixed] = [await open('run'), await open(name)];
    assert.equal(run.sources.names.length, factors.length);
    run.mix(factors);
    assertSame(run, mixed, COLUMNS);
    assert.deepEqual(mixed.sources.factors, factors);
    // And back, from the page of the mixture.
    mixed.mix([1, 1, 1]);
    run.mix(null);
    assertSame(mixed, run, COLUMNS);
  });

  test(`corners at ${factors} are those of the program`, async () => {
    const [run, mixed] = [await open('run'), await open(name)];
    run.mix(factors);
    const most = mixed.smooth.reduce((largest, value) => Math.max(largest, value), 0);
    assert.equal(run.even.length, mixed.smooth.length);
    run.even.forEach((value, i) => assert.ok(Math.abs(value - mixed.smooth[i]) <= 1e-5 * most, `corner ${i}: ${value}, not ${mixed.smooth[i]}`));
  });
}

test('faces on one side of a surface are lit or dark together', async () => {
  const run = await open('run');
  const sides = run.surfaceSides();
  const key = (face) => `${run.columns.surface[face]} ${run.columns.side?.[face]}`;
  const first = new Map();
  sides.forEach((side, face) => {
    if (!first.has(side)) first.set(side, face);
    assert.equal(key(face), key(first.get(side)));
  });
  assert.equal(first.size, new Set(Array.from(sides.keys(), key)).size);
});

test('sources that are all switched off leave the dark', async () => {
  const run = await open('run');
  run.mix([0, 0, 0]);
  for (const name of COLUMNS) for (const channel of run.channels) assert.ok(run.number(name + channel).every((value) => value === 0), name);
});

test('a histogram holds all of the known area, each patch where its light is', () => {
  const [values, area] = [[0, 1, 10, 100, NaN, 5000], [1, 2, 3, 4, 5, 10]];
  const linear = histogram(values, area, { bottom: 0, top: 100, logarithmic: false });
  assert.deepEqual([linear[0], linear[3], linear.at(-1)], [3 / 20, 3 / 20, 14 / 20]);
  const log = histogram(values, area, { bottom: 1, top: 100, logarithmic: true }, (i) => i !== 5);
  assert.deepEqual([log[0], log[16], log.at(-1)], [3 / 10, 3 / 10, 4 / 10]);
});

test('the worst patch of the list is that of the headline, and each is listed once', async () => {
  const run = await open('run');
  const { headline } = run.facts.summary;
  const listed = run.worst(20, 0);
  const width = run.relativeHalfWidth()[listed[0]];
  assert.ok(Math.abs(width - headline.worst) <= 1e-9 * width, `${width}, not ${headline.worst}`);
  assert.equal(run.cell('patch', listed[0]), String(headline.worst_patch));
  assert.equal(new Set(listed.map((row) => run.cell('patch', row) + (run.columns.side?.at(row) ?? ''))).size, listed.length);
  run.mix([0.3, 1.7, 1]);
  assert.ok(run.worst(20, 0).every((row) => run.relativeHalfWidth()[row] > 0));
});

test('cells of sensors are no triangles, and areas of rows are those of the table', async () => {
  const run = await open('run');
  assert.equal(run.isTriangle(run.size), false);
  run.area.forEach((area, i) => assert.ok(Math.abs(area - Number(run.cell('area', i))) <= 1e-5 * area));
});

test('a page of many patches knows the irradiance of what emits or is black', async () => {
  const many = await open('many');
  const [table, told] = [columns(readFileSync(join(FOLDER, 'many', 'patches.csv'), 'utf8')), many.number('irradiance')];
  assert.ok(many.facts.compact.rows === table.patch.length);
  const known = told.filter((value, i) => {
    const truth = table.irradiance[i] === '' ? NaN : Number(table.irradiance[i]);
    assert.ok(Number.isNaN(truth) ? Number.isNaN(value) : Math.abs(value - truth) <= 1e-3 * truth, `${value}, not ${truth}`);
    return !Number.isNaN(value) && (many.number('emittance')[i] > 0 || many.number('reflectance')[i] === 0);
  });
  assert.ok(known.length > 1000);
});

test('cells of a group show the area and the middle of their patch', () => {
  const square = (x) => [x, 0, 0, x + 1, 0, 0, x + 1, 1, 0, x, 1, 0];
  const grouped = Object.assign(Object.create(CompactResult.prototype), {
    size: 3, patches: [7, 7, 8], columns: { patch: [7, 7, 8] }, corners: Float32Array.from([0, 1, 2].flatMap(square)),
  });
  grouped.area = grouped.areas();
  assert.deepEqual([0, 1, 2].map((row) => grouped.cell('area', row)), ['2', '2', '1']);
  assert.deepEqual([0, 1, 2].map((row) => grouped.cell('x', row)), ['1', '1', '2.5']);
});

test('pictures have the contrast of the program, and scales leave emitters out', async () => {
  const light = [0.25, 0.5, 0];
  bend(light, [1, 2]);
  assert.deepEqual(light, [0.125, 0.25, 0]);
  bend(light, [0.2, 2]);
  assert.deepEqual(light, [0.125, 0.25, 0]);
  const run = await open('run');
  assert.ok(run.facts.contrast[0] > 0 && run.facts.contrast[1] >= 1);
  const radiosity = quantities(run).find(({ key }) => key === 'radiosity');
  const { range: { top } } = shade(run, { quantity: radiosity, channel: 'mean', logarithmic: false });
  const emits = run.quantity('emittance', 'mean');
  assert.ok(top <= run.quantity('radiosity', 'mean').reduce((most, value, i) => (emits[i] > 0 ? most : Math.max(most, value)), 0));
});
