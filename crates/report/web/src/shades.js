// What can be shown of the faces: quantities with units, and the colours that stand for them.

import { areaQuantile, bend, encode, scale, tone, UNKNOWN } from './colours.js';

const FLAGS = [
  ['unsampled', 'no walk gives an estimate: numbers are missing', UNKNOWN],
  ['bias', 'walks were cut off: the value may be too small', [213, 94, 0]],
  ['rare', 'fewer than 10 scores: trust the interval, not the value', [86, 180, 233]],
  ['emitter', 'emits light', [240, 228, 66]],
  ['', 'nothing to say', [110, 110, 110]],
];

/** The quantities that can be shown, for the list of the page. */
export function quantities(result) {
  const { radiosity: light, irradiance: flux } = result.facts.summary.units;
  const all = [
    { key: 'picture', label: 'Picture (as an eye sees it)', unit: light, picture: true },
    { key: 'radiosity', label: 'Radiosity', unit: light, of: (channel) => result.quantity('radiosity', channel) },
    { key: 'irradiance', label: 'Irradiance', unit: flux, of: (channel) => result.quantity('irradiance', channel) },
    { key: 'std_error', label: 'Standard error of the radiosity', unit: light, of: (channel) => result.quantity('std_error', channel) },
    { key: 'half_width', label: `Relative half-width of the ${result.judged}`, unit: '', percent: true, of: () => result.relativeHalfWidth() },
    { key: 'hits', label: 'Hits', unit: '', of: () => result.number('hits') },
    { key: 'flags', label: 'Flags', unit: '', flags: true },
  ];
  return all.filter(({ key }) => key === 'picture' || key === 'half_width' || result.has(key));
}

/** Colours of all faces, three bytes a face or three a corner, the legend that explains them, and of numbers their range. */
export function shade(result, { quantity, channel, logarithmic, stops, even }) {
  if (quantity.picture) return picture(result, stops, even);
  if (quantity.flags) return flags(result);
  return numbers(result, quantity, quantity.of(channel), logarithmic);
}

/** As radiosity.png is exposed: white is the colour of all emitted light together. */
function picture(result, stops, even) {
  const count = result.channels.length;
  const channels = [0, 1, 2].map((c) => c % count);
  const { view: { exposure, white: brightest }, contrast } = result.facts;
  const gain = 2 ** stops;
  const white = result.channels.map((_, c) => brief(brightest[c] / gain));
  const words = `White is ${white.join(', ')} ${result.facts.summary.units.radiosity} and above${white.length > 1 ? ' (red, green, blue)' : ''}.`;
  const light = even ? result.even : flat(result);
  const bytes = new Uint8Array(3 * (light.length / count));
  const shown = [0, 0, 0];
  for (let i = 0; i < bytes.length / 3; i += 1) {
    for (let c = 0; c < 3; c += 1) shown[c] = light[count * i + channels[c]] * exposure[channels[c]];
    bend(shown, contrast);
    for (let c = 0; c < 3; c += 1) shown[c] *= gain;
    tone(shown);
    for (let c = 0; c < 3; c += 1) bytes[3 * i + c] = encode(shown[c]);
  }
  return { bytes, legend: { words } };
}

/** The radiosity of every face, the channels of a face side by side; what the face emits, where no walk gives an estimate. */
function flat(result) {
  const count = result.channels.length;
  const light = new Float32Array(count * result.size);
  result.channels.forEach((channel, c) => {
    const [radiosity, emitted] = ['radiosity', 'emittance'].map((name) => result.number(name + channel));
    for (let i = 0; i < result.size; i += 1) light[count * i + c] = Number.isNaN(radiosity[i]) ? emitted[i] : radiosity[i];
  });
  return light;
}

function flags(result) {
  const bytes = new Uint8Array(3 * result.size);
  const seen = new Set();
  result.columns.flags.forEach((words, i) => {
    const held = words.split('|');
    const [word, , colour] = FLAGS.find(([flag]) => held.includes(flag)) ?? FLAGS.at(-1);
    seen.add(word);
    bytes.set(colour, 3 * i);
  });
  const entries = FLAGS.filter(([word]) => seen.has(word)).map(([word, words, colour]) => ({ colour, words: word ? `${word}: ${words}` : words }));
  return { bytes, legend: { entries } };
}

function numbers(result, quantity, values, logarithmic) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (!Number.isFinite(value) || (logarithmic && value <= 0)) continue;
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  if (low > high) [low, high] = [0, 0];
  // A linear scale ends where 97 % of the area that does not emit does, so that neither a lamp nor a window hides the room.
  const emittances = result.channels.map((channel) => result.number('emittance' + channel));
  const dark = (i) => emittances.every((emittance) => emittance[i] === 0);
  const most = areaQuantile(values, result.area, 0.97, dark) || areaQuantile(values, result.area, 0.97);
  const top = logarithmic ? high : Math.max(most, low);
  const bottom = logarithmic ? Math.max(low, high * 1e-6) : Math.min(0, low);
  const form = logarithmic ? Math.log : (value) => value;
  const [from, span] = [form(bottom), form(top) - form(bottom) || 1];
  const bytes = new Uint8Array(3 * result.size);
  let unknown = false;
  values.forEach((value, i) => {
    const known = Number.isFinite(value);
    unknown ||= !known;
    const part = value <= 0 && logarithmic ? 0 : (form(value) - from) / span;
    bytes.set(known ? scale(part) : UNKNOWN, 3 * i);
  });
  const written = (value) => (quantity.percent ? `${brief(100 * value)} %` : `${brief(value)} ${quantity.unit}`.trim());
  const middle = logarithmic ? Math.sqrt(bottom * top) : (bottom + top) / 2;
  const ticks = [bottom, middle, top].map(written);
  if (top < high) ticks[2] = `≥ ${ticks[2]}`;
  // A page of many patches knows no interval of H where they emit or are black.
  const missing = quantity.percent && result.facts.compact ? 'no number, or none kept in this page; see patches.csv' : 'no number: no walk gives an estimate';
  return { bytes, legend: { ticks, unknown: unknown && missing }, range: { values, bottom, top, logarithmic } };
}

/** A number in four digits. */
export function brief(value) {
  if (value === 0) return '0';
  const size = Math.abs(value);
  return size >= 1e5 || size < 1e-3 ? value.toExponential(2) : String(Number(value.toPrecision(4)));
}
