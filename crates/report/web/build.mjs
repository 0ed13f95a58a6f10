// Bundles the script of report.html into ../assets/viewer.js.gz, which `cargo build` takes as they are.
import { build } from 'esbuild';
import { writeFileSync } from 'node:fs';
import { gzipSync } from 'node:zlib';

const here = new URL('.', import.meta.url).pathname;
const { outputFiles } = await build({
  absWorkingDir: here, entryPoints: ['src/main.js'], bundle: true, minify: true, format: 'esm', target: 'es2022', write: false,
  legalComments: 'inline',
});
const script = outputFiles[0].text.replaceAll('</script', '<\\/script');
writeFileSync(`${here}../assets/viewer.js.gz`, gzipSync(script, { level: 9 }));
console.log(`${script.length} characters`);
