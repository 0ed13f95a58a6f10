// Mixtures of sources: the light where each source emits by another factor, as `radwalk combine` tells it. A walk has one source, so
// that the moments of weighted scores are sums over the sources (docs/theory/mixtures.md).

/** The number of telling walks at which half of the caution due to few of them is gone. */
const CAUTIOUS_WALKS = 20;

/** Planes of numbers before those of channels: the source that a row is an emitter of, and what probabilities of sizes are multiplied by. */
const OF_ROW = 2;

/** Planes of numbers that each channel has before those of its sources: E, H for each hit, the bound on E[x²]/E[x]. */
const OF_CHANNEL = 3;

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

/** Byar's approximation of the mean at which a Poisson count is z standard deviations away. */
function byar(count, z) {
  const root = 1 - 1 / (9 * count) + z / (3 * Math.sqrt(count));
  return count * Math.max(root, 0) ** 3;
}

/** The third cumulant of scores over their mean, where they are zero or geometric and have the variance c·mean. */
function thirdCumulant(c, mean) {
  const d = c + mean;
  return 1.5 * d * d - 0.5 - 3 * mean * d + 2 * mean * mean;
}

/** The interval of the mean score in hits: `stats::mean_interval` of the program, where each step is derived. */
export function meanInterval({ n, sum, squares, variance, counts }, unit, { tail, deviate }, bound) {
  if (sum === 0) return [0, -bound * Math.expm1(Math.log(tail) / n)];
  const hit = unit === 1 && counts ? 1 : (unit * squares) / sum;
  const perHit = unit / hit;
  const ratio = Math.max(bound / hit, 1);
  const hits = perHit * sum;
  const mean = hits / n;
  const most = Math.max(ratio, mean);
  const spread = n * perHit * perHit * variance;
  const size = (perHit * perHit * squares) / hits;
  const caution = 1 / (1 + Math.min(hits / size, 4 * spread) / CAUTIOUS_WALKS);
  const weight = size * caution * caution;
  const c = (spread + weight * ratio) / (hits + weight);
  const shift = (2 * deviate * deviate + 1) / 6;
  const skewness = thirdCumulant(c, mean) / c - c;
  const misses = caution * (c - 1);
  const count = hits / c + 0.5;
  const halfStep = 0.5 * caution * Math.max(c, 1);
  const low = c * byar(count, -deviate) - halfStep + shift * Math.min(skewness, misses, 0);
  const high = c * byar(count, deviate) + halfStep + shift * Math.max(skewness, 0);
  return [hit * clamp(low / n, 0, mean), hit * clamp(high / n, mean, most)];
}

/** The most that sizes above `seen` add to the mean where no walk has met them: `stats::Sizes::beyond`. Classes are [size, probability, mean], both of these
 * summed up from the largest size on. */
function beyond(classes, seen, budget, scale) {
  const larger = classes.filter(([size]) => size > seen);
  const within = larger.filter(([, probability]) => scale * probability <= budget).length;
  const [, probability, mean] = within > 0 ? larger[within - 1] : [0, 0, 0];
  const rest = within < larger.length ? (budget - scale * probability) * (larger[within][0] - seen) : 0;
  return scale * (mean - probability * seen) + rest;
}

/** The interval of the mean score, with room for sizes that no walk has met: that of `Estimates` in the program. */
function interval(sample, unit, dials, bound, [classes, scale]) {
  const [low, high] = meanInterval(sample, unit, dials, bound);
  const { n, sum, squares } = sample;
  if (sum === 0 || classes.length === 0) return [low, high];
  const unmet = beyond(classes, (unit * squares) / sum, -Math.expm1(Math.log(dials.tail) / n), scale);
  const mean = (unit * sum) / n;
  return [low, mean + Math.hypot(high - mean, unmet)];
}

/** The moments of n walks. */
function sampleOf(n, sum, squares, counts) {
  return { n, sum, squares, variance: Math.max(squares - sum * (sum / n), 0) / (n - 1), counts };
}

/** Parts within an eighth of a power of two go together. */
const bits = new DataView(new ArrayBuffer(8));
function partKey(part) {
  bits.setFloat64(0, part);
  return bits.getUint32(0) >>> 17;
}

/** The interval of a mixture, from those of sources with nearly the same part: `Shares::interval` of the program. `own` is the interval of a sample. */
function mixedInterval(whole, unit, scores, own) {
  if (whole.counts) return own(whole);
  const { n } = whole;
  const alike = new Map();
  for (const score of scores.filter(({ part }) => part > 0)) {
    const key = score.sum > 0 ? partKey(score.part) : 'none';
    alike.set(key, [...(alike.get(key) ?? []), score]);
  }
  let [below, above, variance] = [0, 0, 0];
  for (const group of alike.values()) {
    const part = Math.max(...group.map((score) => score.part));
    const counts = group.every((score) => score.part === part);
    const total = (of) => group.reduce((sum, score) => sum + of(score, score.part / part), 0);
    const sample = sampleOf(n, total(({ sum }, f) => f * sum), total(({ squares }, f) => f * f * squares), counts);
    const [mean, [low, high]] = [(unit * sample.sum) / n, own(sample)];
    below = Math.hypot(below, part * (mean - low));
    above = Math.hypot(above, part * (high - mean));
    variance += part * part * sample.variance;
  }
  const excluding = variance > 0 ? Math.min(Math.sqrt(whole.variance / variance), 1) : 1;
  const mean = (unit * whole.sum) / n;
  return [Math.max(mean - excluding * below, 0), mean + excluding * above];
}

/** The sources of a result: their names, and the scores that the light of any mixture is made from. */
export class Sources {
  /** `planes` are those that the page holds: a number for each row of the table in each. */
  constructor({ names, factors, ...dials }, planes, size) {
    this.names = names;
    this.factors = factors;
    this.dials = dials;
    this.plane = (number) => planes.subarray(number * size, (number + 1) * size);
    this.size = size;
  }

  /** Columns of the table that a mixture changes, for each channel; reflectances are those of the channels. */
  mix(factors, channels, reflectances) {
    const columns = new Map();
    channels.forEach((channel, c) => {
      const first = OF_ROW + c * (OF_CHANNEL + 2 * this.names.length);
      for (const [name, values] of Object.entries(this.mixOne(factors, first, reflectances[c], this.dials.sizes[c], this.dials.lit[c]))) columns.set(name + channel, values);
    });
    return columns;
  }

  /** The light of one channel, whose planes begin at number `first`. */
  mixOne(factors, first, reflectance, sizes, lit) {
    const { walks: n, unit } = this.dials;
    const light = ['irradiance', 'irradiance_error', 'irradiance_low', 'irradiance_high'];
    const names = ['emittance', 'radiosity', 'std_error', 'ci_low', 'ci_high', ...light];
    const told = Object.fromEntries(names.map((name) => [name, new Float64Array(this.size)]));
    const scale = Math.max(...factors) || 1;
    const parts = factors.map((factor) => factor / scale);
    // Where all that counts counts alike, scores are whole numbers of hits.
    const counts = parts.every((part) => part === 0 || part === 1);
    const [source, scales, emittance, perHit, bound] = [0, 1, first, first + 1, first + 2].map(this.plane);
    const sums = factors.flatMap((_, s) => [0, 1].map((moment) => this.plane(first + OF_CHANNEL + 2 * s + moment)));
    for (let i = 0; i < this.size; i += 1) {
      let [sum, squares] = [0, 0];
      parts.forEach((part, s) => {
        sum += part * sums[2 * s][i];
        squares += part * part * sums[2 * s + 1][i];
      });
      const whole = sampleOf(n, sum, squares, counts);
      const own = (sample) => interval(sample, unit, this.dials, bound[i], [sizes, scales[i]]);
      // A source without light in the channel is known to bring none.
      const scores = parts.map((part, s) => ({ part: lit[s] ? part : 0, sum: sums[2 * s][i], squares: sums[2 * s + 1][i] }));
      const emitted = source[i] < 0 ? 0 : emittance[i] * factors[source[i]];
      const hit = perHit[i] * scale;
      const reflected = Number.isNaN(hit) ? 0 : reflectance[i] * hit;
      const dark = factors.every((factor) => factor === 0);
      const [low, high] = dark ? [0, 0] : mixedInterval(whole, unit, scores, own);
      const [mean, error] = [(unit * sum) / n, unit * Math.sqrt(whole.variance / n)];
      told.emittance[i] = emitted;
      // No score says nothing but a bound; what reflects nothing, and darkness, are known without scores.
      const unknown = sum === 0 && !dark;
      told.radiosity[i] = unknown && reflected > 0 && emitted === 0 ? NaN : emitted + reflected * mean;
      told.std_error[i] = unknown && reflected > 0 ? NaN : reflected * error;
      told.ci_low[i] = emitted + reflected * low;
      told.ci_high[i] = emitted + reflected * high;
      told.irradiance[i] = unknown ? NaN : hit * mean;
      told.irradiance_error[i] = unknown ? NaN : hit * error;
      told.irradiance_low[i] = hit * low;
      told.irradiance_high[i] = hit * high;
    }
    return told;
  }
}
