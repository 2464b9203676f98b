// run.mjs PROGRAM FOLDER VIEWER: the small run that the other tests look at.
import { existsSync, join, skip, smallRun, mkdirSync, writeFileSync, chromiumPath } from './common.mjs';
const [program, folder, viewer] = process.argv.slice(2);
if (!existsSync(join(viewer, 'app.js'))) skip('the pages were not built (node, npm or the network is missing)');
mkdirSync(folder, { recursive: true });
chromiumPath();
writeFileSync(join(folder, 'run.json'), smallRun(program, folder));
console.log('the small run is there');
