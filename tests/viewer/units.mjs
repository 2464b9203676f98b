// units.mjs OUT [FOLDER]: unit tests of viewer/test, or with a small run those of its models, bundled and run by node's own runner.
import { existsSync } from 'node:fs';
import { join } from 'node:path';
import { skip } from './checks.mjs';
import { packageOf, root } from './packages.mjs';
import { spawnSync } from 'node:child_process';
const [out, folder] = process.argv.slice(2);
if (folder && !existsSync(join(folder, 'report', 'index.html'))) skip('there is no small run');
const { build } = packageOf('esbuild');
const name = folder ? 'models' : 'units', file = join(out, `${name}.test.cjs`);
await build({ entryPoints: [join(root, 'viewer', 'test', `${name}.ts`)], outfile: file, bundle: true, platform: 'node', format: 'cjs', target: 'node18', logLevel: 'warning' });
const ended = spawnSync(process.execPath, ['--test', file], { encoding: 'utf8', env: { ...process.env, GEOCAGE_SMALL_RUN: folder ?? '' } });
console.log(ended.stdout + ended.stderr);
process.exit(ended.status);
