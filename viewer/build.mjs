// node build.mjs OUT: app.js, scene.js, plots.js and app.css for a report.
import { build } from 'esbuild';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { copyFileSync } from 'node:fs';

const here = dirname(fileURLToPath(import.meta.url));
const out = process.argv[2] ?? join(here, 'out');
await build({
  entryPoints: ['app', 'scene', 'plots'].map((name) => join(here, 'src', `${name}.ts`)),
  outdir: out,
  bundle: true,
  minify: true,
  format: 'iife',
  target: 'es2021',
  legalComments: 'eof', // licences of the packages stay with their code
  charset: 'utf8',
  logLevel: 'warning',
});
copyFileSync(join(here, 'src', 'app.css'), join(out, 'app.css'));
