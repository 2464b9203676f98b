// without.mjs PROGRAM FOLDER SOURCES: without node, and without the network, the build of the pages ends well and says what is missing; a
// report is then the plain page, and says it too.
import { cpSync, existsSync, mkdirSync, readFileSync, rmSync, symlinkSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { end, expect } from './checks.mjs';
import { torus } from './small_run.mjs';
import { spawnSync } from 'node:child_process';
const [program, folder, sources] = process.argv.slice(2);
rmSync(folder, { recursive: true, force: true });
mkdirSync(join(folder, 'bin'), { recursive: true });
mkdirSync(join(folder, 'viewer'));
for (const tool of ['sh', 'cat', 'cksum', 'rm', 'mkdir', 'touch', 'dirname', 'cut']) {
  const found = spawnSync('sh', ['-c', `command -v ${tool}`], { encoding: 'utf8' }).stdout.trim();
  if (found.startsWith('/')) symlinkSync(found, join(folder, 'bin', tool));
}
for (const name of ['package.json', 'package-lock.json', '.npmrc', 'build.mjs']) cpSync(join(sources, 'viewer', name), join(folder, 'viewer', name));
const script = join(sources, 'setup', 'viewer.sh');
const bundle = (environment) => spawnSync('sh', [script, join(folder, 'viewer'), join(folder, 'out'), join(folder, 'stamp')], { encoding: 'utf8', env: environment });

const nodeless = bundle({ PATH: join(folder, 'bin') });
expect('without node the build goes on', nodeless.status === 0, nodeless.stderr);
expect('and says what is missing', /3-D views.*node is not here/.test(nodeless.stdout), nodeless.stdout);
// A registry on a port where nobody listens: npm finds no network, at once.
const offline = bundle({ ...process.env, npm_config_registry: 'http://127.0.0.1:9/', npm_config_cache: join(folder, 'cache'), npm_config_fetch_retries: '0' });
expect('without network the build goes on', offline.status === 0, offline.stderr);
expect('and says so', /could not bring the packages/.test(offline.stdout) || /npm is not here/.test(offline.stdout), offline.stdout);
expect('nothing counts as built', !existsSync(join(folder, 'stamp')));

writeFileSync(join(folder, 'ring.ply'), torus(0.05, 0.014, 24, 12));
writeFileSync(join(folder, 'flow.toml'), 'objects = ["ring.ply"]\n');
const run = spawnSync(resolve(program), ['run', 'flow.toml', '--until', 'ring/scan', '--out', 'run', '--quiet'], { cwd: folder, encoding: 'utf8', env: { ...process.env, GEOCAGE_VIEWER: join(folder, 'out') } });
expect('there is a store', run.status === 0, run.stderr);
const bare = spawnSync(resolve(program), ['report', 'flow.toml', '--out', 'report', '--quiet'], { cwd: folder, encoding: 'utf8', env: { ...process.env, GEOCAGE_VIEWER: join(folder, 'out') } });
expect('a report is written', existsSync(join(folder, 'report', 'index.html')), bare.stderr);
expect('that says what it lacks', readFileSync(join(folder, 'report', 'index.html'), 'utf8').includes('no 3-D views'));
const single = spawnSync(resolve(program), ['report', 'flow.toml', '--out', 'report', '--quiet', '--single-file'], { cwd: folder, encoding: 'utf8', env: { ...process.env, GEOCAGE_VIEWER: join(folder, 'out') } });
expect('a single file is refused in words', single.status === 2 && single.stderr.includes('were not built'), single.stderr);
end('without node or network');
