// Colours of numbers. The scale is cividis (Nuñez, Anderton and Renslow, PLoS ONE 13(7), 2018), which people without
// colour vision read alike: lightness grows with the number.

const CIVIDIS = [
  '#00224e', '#123570', '#3b496c', '#575d6d', '#707173', '#8a8678', '#a59c74', '#c3b369', '#e1cc55', '#fee838',
].map((hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16)));

/** What has no number. */
export const UNKNOWN = [214, 120, 190];

/** The colour of 0 … 1 as [red, green, blue] in 0 … 255. */
export function scale(part) {
  if (Number.isNaN(part)) return UNKNOWN;
  const at = Math.min(Math.max(part, 0), 1) * (CIVIDIS.length - 1);
  const low = Math.min(Math.floor(at), CIVIDIS.length - 2);
  return [0, 1, 2].map((c) => CIVIDIS[low][c] + (at - low) * (CIVIDIS[low + 1][c] - CIVIDIS[low][c]));
}

/** The scale as a CSS gradient, from the left to the right. */
export const gradient = `linear-gradient(to right, ${CIVIDIS.map((rgb) => `rgb(${rgb})`).join(', ')})`;

/** Light up to here is shown as it is; from `SHINING` on it is white (`picture/light.rs` of the program). */
const SHOULDER = 0.5;
const SHINING = 6;

/** Bends light that is too bright for a picture, as the program's `tone` does. */
export function tone(light) {
  const peak = Math.max(light[0], light[1], light[2]);
  if (!(peak > SHOULDER)) return;
  const slope = (SHINING - SHOULDER) / (1 - SHOULDER);
  const part = Math.min((peak - SHOULDER) / (SHINING - SHOULDER), 1);
  const bent = SHOULDER + ((1 - SHOULDER) * slope * part) / (1 + (slope - 1) * part);
  for (let c = 0; c < 3; c += 1) light[c] = (light[c] / peak) * bent * (1 - part) + bent * part;
}

/** Darkens light below that of bright pixels by a power, as the program's `Contrast` does; its colour is kept. */
export function bend(light, [bright, power]) {
  const part = Math.max(light[0], light[1], light[2]) / bright;
  if (power === 1 || !(part < 1)) return;
  const gain = part ** (power - 1);
  for (let c = 0; c < 3; c += 1) light[c] *= gain;
}

/** Steps of light in the table of `encode`: so many that none of them is a twentieth of a shade. */
const STEPS = 65536;
const SRGB = Uint8Array.from({ length: STEPS + 1 }, (_, step) => {
  const light = step / STEPS;
  return 255 * (light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055) + 0.5;
});

/** Light 0 … 1 as sRGB 0 … 255. */
export function encode(light) {
  return SRGB[Math.min(Math.max(light, 0), 1) * STEPS + 0.5 | 0];
}

/** The value that a part of the area does not exceed, of faces with a finite value. */
export function areaQuantile(values, areas, part, chosen = () => true) {
  const kept = Array.from(values.keys()).filter((i) => Number.isFinite(values[i]) && chosen(i));
  kept.sort((a, b) => values[a] - values[b]);
  const total = kept.reduce((sum, i) => sum + areas[i], 0);
  let sum = 0;
  for (const i of kept) {
    sum += areas[i];
    if (sum >= part * total) return values[i];
  }
  return 0;
}
