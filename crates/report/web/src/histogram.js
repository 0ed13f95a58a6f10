// A histogram of the quantity that is shown: parts of the area, in the colours of the scale.

import { scale } from './colours.js';

const BINS = 32;
const [WIDTH, HEIGHT] = [256, 64];

/** The part of the area in each of some equal steps of a scale, of the faces that are chosen; what lies beyond an end counts there. */
export function histogram(values, area, { bottom, top, logarithmic }, chosen = () => true) {
  const form = logarithmic ? Math.log : (value) => value;
  const [from, span] = [form(bottom), form(top) - form(bottom) || 1];
  const parts = new Float64Array(BINS);
  let total = 0;
  values.forEach((value, i) => {
    if (!Number.isFinite(value) || !chosen(i)) return;
    const place = logarithmic && value <= 0 ? 0 : (BINS * (form(value) - from)) / span;
    parts[Math.min(Math.max(Math.floor(place), 0), BINS - 1)] += area[i];
    total += area[i];
  });
  return parts.map((part) => part / (total || 1));
}

/** A histogram as SVG. */
export function drawing(parts) {
  const [width, most] = [WIDTH / BINS, Math.max(...parts) || 1];
  const bar = (part, bin) => {
    const height = (HEIGHT * part) / most;
    return `<rect x="${bin * width}" y="${HEIGHT - height}" width="${width - 1}" height="${height}" fill="rgb(${scale((bin + 0.5) / BINS)})"/>`;
  };
  return `<svg viewBox="0 0 ${WIDTH} ${HEIGHT}" width="100%" role="img" aria-label="Parts of the area over the scale">${Array.from(parts, bar).join('')}</svg>`;
}
