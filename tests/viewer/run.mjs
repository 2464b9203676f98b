// run.mjs PROGRAM FOLDER VIEWER: the small run that the other tests look at.
import { existsSync, mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { skip } from './checks.mjs';
import { chromiumPath } from './chromium.mjs';
import { smallRun } from './small_run.mjs';
const [program, folder, viewer] = process.argv.slice(2);
if (!existsSync(join(viewer, 'app.js'))) skip('the pages were not built (node, npm or the network is missing)');
mkdirSync(folder, { recursive: true });
chromiumPath();
writeFileSync(join(folder, 'run.json'), smallRun(program, folder));
console.log('the small run is there');
