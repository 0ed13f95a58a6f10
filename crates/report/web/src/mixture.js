// Mixtures of sources: the light where each source emits by another factor, as `radwalk combine` tells it. A walk has one source, so
// that the moments of weighted scores are sums over the sources (docs/theory/mixtures.md).

/** The number of telling walks at which half of the caution due to few of them is gone. */
const CAUTIOUS_WALKS = 20;

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
      const first = 1 + c * (OF_CHANNEL + 2 * this.names.length);
      for (const [name, values] of Object.entries(this.mixOne(factors, first, reflectances[c]))) columns.set(name + channel, values);
    });
    return columns;
  }

  /** The light of one channel, whose planes begin at number `first`. */
  mixOne(factors, first, reflectance) {
    const { walks: n, unit } = this.dials;
    const light = ['irradiance', 'irradiance_error', 'irradiance_low', 'irradiance_high'];
    const names = ['emittance', 'radiosity', 'std_error', 'ci_low', 'ci_high', ...light];
    const told = Object.fromEntries(names.map((name) => [name, new Float64Array(this.size)]));
    const scale = Math.max(...factors) || 1;
    const parts = factors.map((factor) => factor / scale);
    // Where all that counts counts alike, scores are whole numbers of hits.
    const counts = parts.every((part) => part === 0 || part === 1);
    const [source, emittance, perHit, bound] = [0, first, first + 1, first + 2].map(this.plane);
    const sums = factors.flatMap((_, s) => [0, 1].map((moment) => this.plane(first + OF_CHANNEL + 2 * s + moment)));
    for (let i = 0; i < this.size; i += 1) {
      let [sum, squares] = [0, 0];
      parts.forEach((part, s) => {
        sum += part * sums[2 * s][i];
        squares += part * part * sums[2 * s + 1][i];
      });
      const variance = Math.max(squares - sum * (sum / n), 0) / (n - 1);
      const emitted = source[i] < 0 ? 0 : emittance[i] * factors[source[i]];
      const hit = perHit[i] * scale;
      const reflected = Number.isNaN(hit) ? 0 : reflectance[i] * hit;
      const dark = factors.every((factor) => factor === 0);
      const [low, high] = dark ? [0, 0] : meanInterval({ n, sum, squares, variance, counts }, unit, this.dials, bound[i]);
      const [mean, error] = [(unit * sum) / n, unit * Math.sqrt(variance / n)];
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
