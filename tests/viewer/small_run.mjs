// The small run whose report the tests open.
import { mkdirSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { spawnSync } from 'node:child_process';

/** A torus as ASCII PLY, outward. */
export function torus(R, r, m, n) {
  const at = (i, j) => (i % m) * n + (j % n), lines = [], faces = [];
  for (let i = 0; i < m; ++i)
    for (let j = 0; j < n; ++j) {
      const u = (2 * Math.PI * i) / m, v = (2 * Math.PI * j) / n;
      lines.push([(R + r * Math.cos(v)) * Math.cos(u), (R + r * Math.cos(v)) * Math.sin(u), r * Math.sin(v)].map((x) => x.toFixed(6)).join(' '));
      faces.push(`3 ${at(i, j)} ${at(i + 1, j)} ${at(i + 1, j + 1)}`, `3 ${at(i, j)} ${at(i + 1, j + 1)} ${at(i, j + 1)}`);
    }
  return `ply\nformat ascii 1.0\nelement vertex ${lines.length}\nproperty float x\nproperty float y\nproperty float z\nelement face ${faces.length}\nproperty list uchar int vertex_indices\nend_header\n${lines.join('\n')}\n${faces.join('\n')}\n`;
}

export function run(program, args, cwd, ok = [0]) {
  const ended = spawnSync(program, args, { cwd, encoding: 'utf8', maxBuffer: 1 << 28 });
  if (!ok.includes(ended.status)) throw new Error(`${args.join(' ')}: exit code ${ended.status}\n${ended.stderr.slice(-2000)}`);
  return ended.stdout;
}

/** A ring with two levels of friction, and a file that is no mesh: what a report may hold, in seconds. */
export function smallRun(program, folder) {
  const set = join(folder, 'set');
  mkdirSync(set, { recursive: true });
  writeFileSync(join(set, 'ring.ply'), torus(0.05, 0.014, 56, 20));
  writeFileSync(join(set, 'broken.stl'), 'solid nothing');
  writeFileSync(join(folder, 'small.toml'), `hands = ["schunk_sdh"]
[scan]
views = 4
width = 160
height = 120
[remesh]
edge_length_m = 0.006
[field]
cells = 32
[place]
max_grasps = 3
[cage]
search_samples = 50
wrench_seeds = 1
[sweep]
"evaluate.friction" = [0.0, 0.6]
`);
  rmSync(join(folder, 'report'), { recursive: true, force: true });
  return run(program, ['run', 'small.toml', '--dataset', 'set', '--quiet', '--json', '--store', 'store', '--out', 'report', '--single-file'], folder, [1]);
}
