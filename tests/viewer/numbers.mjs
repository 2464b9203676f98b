// numbers.mjs PROGRAM FOLDER: every number that the pages of the small run show is in an artefact, in results.csv or in the record of
// the run; shares and intervals are worked out anew from results.csv. The text beside each value is its rounding.
import { existsSync, readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import { end, expect, skip } from './checks.mjs';
import { browser } from './chromium.mjs';
import { packageOf } from './packages.mjs';
import { run } from './small_run.mjs';
const [program, folder] = process.argv.slice(2);
const report = join(folder, 'report');
if (!existsSync(join(report, 'index.html'))) skip('there is no small run');
packageOf('playwright-core');

// ---- what is known ----
const known = new Set(), derived = [], texts = [];
const keep = (x) => known.add(String(x));
function walk(value) {
  if (typeof value === 'number') keep(value);
  else if (Array.isArray(value)) value.forEach(walk);
  else if (value && typeof value === 'object') Object.values(value).forEach(walk);
}
const summary = JSON.parse(readFileSync(join(folder, 'run.json'), 'utf8'));
walk(summary);
texts.push(readFileSync(join(folder, 'run.json'), 'utf8'));
const ledger = run(program, ['failures', '--store', 'store', '--json'], folder);
texts.push(ledger, JSON.parse(ledger).failures.map((one) => one.sentence + '\n' + one.command).join('\n'));
const metrics = JSON.parse(run(program, ['metrics', '*', '--store', 'store', '--json'], folder));
walk(metrics);
for (const slot of summary.slots) {
  if (!slot.folder) continue;
  for (const name of readdirSync(join(folder, slot.folder)).filter((one) => one.endsWith('.json'))) {
    const text = readFileSync(join(folder, slot.folder, name), 'utf8'), content = JSON.parse(text);
    walk(content);
    texts.push(text);
    if (content.schema === 'geocage-trajectory 1') derived.push((content.q_rad.length - 1) * content.dt_s);
    if (Array.isArray(content.grasps)) keep(content.grasps.length);
  }
}
const asked = JSON.parse(run(program, ['query', 'select slot, stage, state, made_s from slots', '--out', 'report', '--json'], folder)).rows;
walk(asked);
const taken = new Map(summary.slots.map((slot) => [slot.slot, slot.seconds])), stages = new Map();
for (const [slot, stage, state, made_s] of asked) {
  const one = stages.get(stage) ?? { made: 0, found: 0 };
  if (state === 'hit') one.found += made_s ?? 0;
  else one.made += taken.get(slot);
  stages.set(stage, one);
}
const made = new Map(asked.map(([slot, , , made_s]) => [slot, made_s]));
for (const { slot, metrics: one } of metrics.slots) if (one.trials && made.get(slot)) derived.push(one.trials / made.get(slot));
for (const one of stages.values()) derived.push(one.made, one.found);

function table(text) {
  const rows = [], cells = text.matchAll(/(?:^|,|\n)(?:"((?:[^"]|"")*)"|([^,\n]*))(?=(,|\n|$))/g);
  let row = [];
  for (const cell of cells) {
    row.push(cell[1] !== undefined ? cell[1].replaceAll('""', '"') : cell[2]);
    if (cell[3] !== ',') rows.push(row), (row = []);
  }
  return rows;
}
const csv = readFileSync(join(report, 'results.csv'), 'utf8');
texts.push(csv);
const [head, ...rows] = csv.trimEnd().split('\n').map((line) => table(line)[0]);
for (const row of rows) for (const cell of row) if (cell !== '' && !Number.isNaN(Number(cell))) keep(Number(cell));
for (const name of ['rates', 'paired', 'losses', 'agreement']) walk(JSON.parse(run(program, ['query', `select * from ${name}`, '--out', 'report', '--json'], folder)));

/** Where Wilson's score equation (p' - p)^2 n = z^2 p (1 - p) holds, by bisection from p' to an end. */
function limit(hits, n, edge) {
  const z = 1.959963984540054, share = hits / n, excess = (p) => (share - p) ** 2 * n - z * z * p * (1 - p);
  if ((edge === 0 && hits === 0) || (edge === 1 && hits === n)) return edge;
  let inside = share, outside = edge;
  if (excess(inside + (edge - inside) * 1e-9) > 0) return inside;
  for (let i = 0; i < 200; ++i) {
    const middle = (inside + outside) / 2;
    if (excess(middle) < 0) inside = middle;
    else outside = middle;
  }
  return inside;
}
for (const name of ['object', 'hand', 'heuristic', 'evaluate.friction']) {
  const at = head.indexOf(name), held = head.indexOf('held'), groups = new Map();
  for (const row of rows) groups.set(row[at], [...(groups.get(row[at]) ?? []), Number(row[held])]);
  for (const list of groups.values()) {
    const hits = list.filter((x) => x === 1).length;
    derived.push(hits, list.length, hits / list.length, limit(hits, list.length, 0), limit(hits, list.length, 1));
  }
}

// ---- what is shown ----
const factors = { ' mm': 1000, '°': 180 / Math.PI, ' s': 1, ' %': 100, '': 1 };
function check(page, { value, name, text }) {
  const x = Number(value);
  const there = known.has(String(x)) || derived.some((y) => Math.abs(x - y) <= 1e-9 * Math.max(1, Math.abs(y)));
  expect(`${page}: ${name} = ${value} is in an artefact`, there);
  const parts = /^(-?\d+(?:\.(\d+))?(?:e[+-]\d+)?)( mm|°| s| %)?$/.exec(text);
  expect(`${page}: "${text}" is a number`, parts !== null);
  if (!parts) return;
  const scaled = x * factors[parts[3] ?? ''], half = parts[1].includes('e') ? 0.006 * Math.abs(scaled) : 0.5 * 10 ** -(parts[2]?.length ?? 0);
  expect(`${page}: ${text} is ${value} rounded`, Math.abs(Number(parts[1]) - scaled) <= half * (1 + 1e-9), scaled);
}

const chrome = await browser();
const page = await chrome.newPage({ viewport: { width: 1280, height: 900 } });
page.on('pageerror', (error) => expect('no exception', false, error.message));
await page.goto(`file://${join(report, 'index.html')}`);
await page.waitForSelector('main[data-ready=yes]', { timeout: 60000 });
const hashes = ['#overview', '#sweep', '#run', '#object/ring', '#object/broken',
  ...(await page.$$eval('a[href^="#grasp"]', (links) => [...new Set(links.map((link) => link.getAttribute('href')))]))];
let count = 0;
const all = texts.join('\n');
for (const hash of hashes) {
  await page.evaluate((to) => (location.hash = to), hash);
  await page.waitForFunction(() => document.querySelector('main').dataset.ready === 'yes', null, { timeout: 60000 });
  if (['#sweep', '#run', '#overview'].includes(hash)) await page.waitForFunction(() => [...document.querySelectorAll('.plot')].every((plot) => plot.dataset.ready === 'yes'));
  const { numbers, loose } = await page.evaluate(() => {
    const data = [...document.querySelectorAll('main data')].map((one) => ({ value: one.value, name: one.dataset.name, text: one.textContent }));
    // Digits elsewhere in tables and sentences: names, reasons and commands, which artefacts hold word for word.
    const words = [];
    for (const cell of document.querySelectorAll('main td, main li')) {
      const walker = document.createTreeWalker(cell, NodeFilter.SHOW_TEXT);
      for (let node = walker.nextNode(); node; node = walker.nextNode())
        if (/\d/.test(node.data) && !node.parentElement.closest('data, a, code, option, svg')) words.push(node.data.trim());
    }
    return { numbers: data, loose: words };
  });
  count += numbers.length;
  for (const one of numbers) check(hash, one);
  const wrong = loose.filter((text) => !/^\d+$/.test(text) && !/^S[12]\b|360°/.test(text) && !text.split(/[;:] ?/).every((part) => !/\d/.test(part) || all.includes(part.trim())));
  expect(`${hash}: digits outside <data> are an artefact's words`, wrong.filter((text) => !/^(@|evaluate\.friction|scan\.|schunk_sdh|metrics|[a-z_0-9./@=,]+$)/.test(text)).length === 0, wrong.join(' | '));
}
await chrome.close();
expect('there were numbers to look at', count > 500, count);
console.log(`${count} numbers on ${hashes.length} pages`);
end('numbers');
