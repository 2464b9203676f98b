// big.mjs FOLDER: bytes of the report that big_report made, and how long a browser takes until its table can be used. Measures, asserts nothing.
import { join } from 'node:path';
import { browser } from './chromium.mjs';
import { readdirSync, statSync } from 'node:fs';
const report = join(process.argv[2], 'report');
const bytes = (folder) => readdirSync(folder, { withFileTypes: true }).reduce((sum, one) => sum + (one.isDirectory() ? bytes(join(folder, one.name)) : statSync(join(folder, one.name)).size), 0);
for (const part of ['data', 'pictures', 'viewer']) console.log(`${part}: ${(bytes(join(report, part)) / 1e6).toFixed(1)} MB`);
console.log(`all: ${(bytes(report) / 1e6).toFixed(1)} MB`);
const chrome = await browser();
for (let i = 0; i < 3; ++i) {
  const page = await chrome.newPage({ viewport: { width: 1280, height: 900 } });
  const devtools = await page.context().newCDPSession(page);
  await devtools.send('Performance.enable', { timeDomain: 'threadTicks' });
  const start = performance.now();
  await page.goto(`file://${join(report, 'index.html')}`);
  await page.waitForSelector('.grasp-table tbody tr');
  const { metrics } = await devtools.send('Performance.getMetrics');
  const busy = metrics.find((one) => one.name === 'TaskDuration').value;
  await page.fill('.grasp-table input[type=search]', 'object_07');
  await page.waitForFunction(() => document.querySelector('#shown-rows').textContent.startsWith('20 of '));
  const { entry, tasks } = await page.evaluate(() => ({ entry: performance.getEntriesByName('geocage-ready')[0].startTime, tasks: performance.now() }));
  console.log(`the page was busy for ${(1000 * busy).toFixed(0)} ms of CPU time until its table was there`);
  console.log(`opened: the table was there ${entry.toFixed(0)} ms after navigation began; a word filtered it ${(performance.now() - start).toFixed(0)} ms after the start (${tasks.toFixed(0)} ms of the page)`);
  await page.close();
}
await chrome.close();
