// browser.mjs PROGRAM FOLDER: a headless Chromium opens the report of the small run from disk and uses it. Screenshots stay in FOLDER/pictures.
import { existsSync, mkdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { end, expect, skip } from './checks.mjs';
import { browser } from './chromium.mjs';
import { packageFile } from './packages.mjs';
import { run } from './small_run.mjs';
const [program, folder] = process.argv.slice(2);
const report = join(folder, 'report', 'index.html');
if (!existsSync(report)) skip('there is no small run');
const pictures = join(folder, 'pictures');
mkdirSync(pictures, { recursive: true });
const axe = readFileSync(packageFile("axe-core/axe.min.js"), 'utf8');

async function openPage(chrome, width, address) {
  const page = await chrome.newPage({ viewport: { width, height: 860 } });
  page.on('console', (message) => message.type() === 'error' && expect('no error on the console', false, message.text()));
  page.on('pageerror', (error) => expect('no exception', false, error.message));
  page.on('request', (request) => expect('nothing is fetched from a network', /^(file|data|blob):/.test(request.url()), request.url()));
  await page.goto(address);
  await ready(page);
  return page;
}
const ready = (page) => page.waitForSelector('main[data-ready=yes]', { timeout: 60000 });
async function go(page, hash) {
  await page.evaluate((to) => (location.hash = to), hash);
  await page.waitForFunction(() => document.querySelector('main').dataset.ready === 'yes', null, { timeout: 60000 });
}
/** Distinct colours of the canvas, and a digest of its pixels. */
const canvas = (page) => page.evaluate(async () => {
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  const from = document.querySelector('.stage canvas'), small = document.createElement('canvas');
  small.width = 160;
  small.height = 100;
  const pen = small.getContext('2d');
  pen.drawImage(from, 0, 0, 160, 100);
  const bytes = pen.getImageData(0, 0, 160, 100).data, colours = new Set();
  let digest = 0;
  for (let i = 0; i < bytes.length; i += 4) {
    colours.add((bytes[i] << 16) | (bytes[i + 1] << 8) | bytes[i + 2]);
    digest = (digest * 31 + bytes[i] + 3 * bytes[i + 1] + 7 * bytes[i + 2]) | 0;
  }
  return { colours: colours.size, digest };
});
async function accessible(page, name) {
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ['violations'], preload: false }));
  for (const one of violations)
    if (['serious', 'critical'].includes(one.impact)) expect(`axe on ${name}`, false, `${one.id}: ${one.nodes.slice(0, 3).map((node) => node.html.slice(0, 120)).join(' | ')}`);
  return violations.length;
}

const chrome = await browser();
const address = `file://${report}`;
const wide = await openPage(chrome, 1280, address);

// Overview: counts, filter, sort.
const rows = () => wide.locator('.grasp-table tbody tr').count();
const all = await rows();
expect('a row a grasp, and one a lost pair', all >= 4, all);
await wide.fill('.grasp-table input[type=search]', 'ring');
expect('the search leaves the ring alone', (await rows()) === all - 2, await rows());
await wide.fill('.grasp-table input[type=search]', '');
await wide.selectOption('.grasp-table .filters label:has-text("object") select', 'broken');
expect('the filter leaves the broken ones', (await rows()) === 2, await rows());
await wide.selectOption('.grasp-table .filters label:has-text("object") select', '');
await wide.click('.grasp-table th button:text-is("rank")');
const ranks = await wide.$$eval('.grasp-table tbody data[data-name=rank]', (list) => list.map((one) => Number(one.value)));
expect('sorted by rank, best first', ranks.length >= 3 && ranks.every((x, i) => i === 0 || ranks[i - 1] >= x), ranks.join(' '));
await wide.click('.grasp-table th button:text-is("rank")');
const turned = await wide.$$eval('.grasp-table tbody data[data-name=rank]', (list) => list.map((one) => Number(one.value)));
expect('and the other way round', turned.every((x, i) => i === 0 || turned[i - 1] <= x), turned.join(' '));
await accessible(wide, 'overview');
await wide.screenshot({ path: join(pictures, 'overview-1280.png'), fullPage: true });

// A grasp: the canvas shows something, and answers.
const graspHash = await wide.getAttribute('.grasp-table td a[href^="#grasp"]', 'href');
await go(wide, graspHash);
const first = await canvas(wide);
expect('the 3-D canvas is not empty', first.colours > 50, first.colours);
let before = first.digest;
async function changes(what, act) {
  await act();
  const now = await canvas(wide);
  expect(`${what} changes the picture`, now.digest !== before);
  before = now.digest;
}
const controls = (title) => wide.locator(`.controls fieldset:has(legend:has-text("${title}"))`);
const slide = (title, value) => controls(title).locator('input[type=range]').evaluate((box, to) => {
  box.value = to;
  box.dispatchEvent(new Event('input'));
}, value);
await changes('another field', () => controls('Colour').locator('select').first().selectOption('curvature_sum_rad'));
await changes('another colour map', () => controls('Colour').locator('select').nth(1).selectOption('cividis'));
expect('the legend names the quantity', (await wide.textContent('.legend-box')).includes('S2: total curvature'));
await changes('a section', () => controls('Section').locator('select').selectOption('z'));
await changes('no section', () => controls('Section').locator('select').selectOption('none'));
await changes('opening the hand', () => slide('Posture', 0));
await changes('the approach', () => slide('Playback', 0.3));
await controls('Playback').locator('button.play').click();
await wide.waitForFunction(() => Number(document.querySelector('.controls output.time').textContent.split(' ')[0]) > 0, null, { timeout: 20000 });
const played = Number((await wide.textContent('.controls output.time')).split(' ')[0]);
await wide.waitForFunction((from) => Number(document.querySelector('.controls output.time').textContent.split(' ')[0]) > from, played, { timeout: 20000 });
await controls('Playback').locator('button:text-is("Pause")').click();
await controls('Playback').locator('button:text-is("Rest")').click();
before = (await canvas(wide)).digest;
await changes('the geodesic ball', () => wide.click('button.own-ball'));
expect('the ball drawn has as many vertices as the artefact says', await wide.evaluate(() => document.querySelector('.viewer').dataset.ballAgrees === 'yes'));
await changes('keys', async () => {
  await wide.focus('.stage canvas');
  await wide.keyboard.press('ArrowLeft');
  await wide.keyboard.press('+');
});
if (await controls('Show').locator('label:has-text("occupied cells")').count())
  await changes('occupied cells', () => controls('Show').locator('label:has-text("occupied cells") input').check());
const link = await wide.evaluate(() => location.href);
expect('the address remembers the view', /eye=/.test(link) && /ball=/.test(link), link);
await accessible(wide, 'grasp');
await wide.screenshot({ path: join(pictures, 'grasp-1280.png'), fullPage: true });
const again = await openPage(chrome, 1280, link);
expect('a link opens the same view', (await again.evaluate(() => location.hash)).includes('ball='));
expect('with the same colours', (await again.textContent('.legend-box')).includes('S2: total curvature'));
await again.close();

for (const [name, hash] of [['object', '#object/ring'], ['compare', null], ['sweep', '#sweep'], ['run', '#run']]) {
  const pair = graspHash.split('/')[1];
  await go(wide, hash ?? `#compare/${pair}/0/${pair}/1`);
  if (name === 'sweep' || name === 'run') {
    await wide.waitForSelector('.plot[data-ready=yes]', { timeout: 30000 });
    expect(`${name} draws SVG`, (await wide.locator('.plot svg path').count()) > 0);
  }
  if (name === 'run') {
    expect('a failure tells its command', (await wide.textContent('main')).includes('geocage run'));
    expect('a parameter tells who set it', (await wide.textContent('main')).includes('set by'));
  }
  if (name === 'compare') expect('two canvases', (await wide.locator('.stage canvas').count()) === 2);
  await accessible(wide, name);
  await wide.screenshot({ path: join(pictures, `${name}-1280.png`), fullPage: true });
}
await wide.close();

const narrow = await openPage(chrome, 360, address);
for (const [name, hash] of [['overview', '#overview'], ['grasp', graspHash], ['object', '#object/ring']]) {
  await go(narrow, hash);
  const overflow = await narrow.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  expect(`${name} fits 360 px`, overflow <= 0, `${overflow} px too wide`);
  await narrow.screenshot({ path: join(pictures, `${name}-360.png`), fullPage: true });
}
await accessible(narrow, 'object at 360 px');
await narrow.close();

// One file holds the same.
const single = await openPage(chrome, 1280, `file://${join(folder, 'report', 'report.html')}${graspHash}`);
expect('the single file shows the grasp', (await canvas(single)).colours > 50);
await single.close();

// geocage view: mesh and grasp of one's own.
const grasps = JSON.parse(run(program, ['show', graspSlot(), '--store', 'store', '--json'], folder));
const shown = run(program, ['view', 'set/ring.ply', join(grasps.folder, 'grasps.json'), '--out', 'view'], folder).trim();
const view = await openPage(chrome, 1280, `file://${join(folder, shown)}#grasp/0/0`);
expect('geocage view shows it', (await canvas(view)).colours > 50);
await view.close();
await chrome.close();

function graspSlot() {
  return JSON.parse(readFileSync(join(folder, 'run.json'), 'utf8')).slots.find((slot) => slot.folder && slot.slot.includes('/place/')).slot;
}

// Without WebGL pictures remain.
const blind = await browser(['--disable-gpu', '--disable-3d-apis']);
const flat = await openPage(blind, 1280, address + graspHash);
expect('without WebGL a picture is shown', await flat.evaluate(async () => {
  const image = document.querySelector('.stage.flat img');
  await image.decode();
  return image.naturalWidth >= 128;
}));
await flat.screenshot({ path: join(pictures, 'grasp-without-webgl-1280.png') });
await blind.close();
end('the report in a browser');
