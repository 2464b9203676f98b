// The pages' TypeScript has no mistake of type.
import { existsSync } from 'node:fs';
import { join } from 'node:path';
import { skip } from './checks.mjs';
import { root } from './packages.mjs';
import { spawnSync } from 'node:child_process';
const compiler = join(root, 'viewer', 'node_modules', 'typescript', 'bin', 'tsc');
if (!existsSync(compiler)) skip('npm’s packages are not here');
const ended = spawnSync(process.execPath, [compiler, '--noEmit', '-p', join(root, 'viewer')], { encoding: 'utf8' });
console.log(ended.stdout + ended.stderr);
process.exit(ended.status);
