// What the page was made from: the summary, the table and the corners of the faces, all inside the page itself.

import { CompactResult } from './compact.js';
import { Sources } from './mixture.js';
import { columns, Result } from './result.js';

/** Text of an element that holds data. */
const text = (page, id) => page.getElementById(id).textContent;

/** Bytes of an element that holds base64 of a zlib stream. */
async function inflate(page, id) {
  const letters = atob(text(page, id));
  const packed = new Uint8Array(letters.length);
  for (let at = 0; at < letters.length; at += 1) packed[at] = letters.charCodeAt(at);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Response(stream).arrayBuffer();
}

/** Everything a page shows. News of a run come without corners: those of the result that its first page showed stay. */
export async function load(page, known = null) {
  const facts = JSON.parse(text(page, 'facts'));
  if (facts.compact) return withSensors(page, new CompactResult(facts, await inflate(page, 'compact')), known);
  const [table, smooth] = await Promise.all(['table', 'smooth'].map((id) => inflate(page, id)));
  const corners = known?.corners ?? new Float32Array(await inflate(page, 'corners'));
  const result = new Result(facts, new TextDecoder().decode(table), corners, new Float32Array(smooth));
  if (facts.dials) result.sources = new Sources(facts.dials, new Float64Array(await inflate(page, 'scores')), result.size);
  return withSensors(page, result, known);
}

async function withSensors(page, result, known) {
  if (page.getElementById('sensor-table')) {
    const read = new TextDecoder().decode(await inflate(page, 'sensor-table'));
    const places = known?.sensors?.corners ?? new Float32Array(await inflate(page, 'sensor-corners'));
    result.sensors = { columns: columns(read), corners: places, size: places.length / 12 };
  }
  return result;
}
