// The npm packages that viewer/ brought.
import { createRequire } from 'node:module';
import { join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { skip } from './checks.mjs';

export const root = resolve(fileURLToPath(import.meta.url), '../../..');

export function packageOf(name) {
  const require = createRequire(join(root, 'viewer', 'package.json'));
  try {
    return require(name);
  } catch {
    skip(`the npm package ${name} is not here (node, npm or the network was missing when the pages were built)`);
  }
}

export function packageFile(path) {
  packageOf(path.split('/')[0]);
  return join(root, 'viewer', 'node_modules', path);
}
