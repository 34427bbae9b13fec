// Uses the report as a reader would, in a headless Chromium with software WebGL.
// node check.mjs CHROMIUM REPORT.html FOLDER: screenshots go to the folder.

import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import path from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

const here = path.dirname(fileURLToPath(import.meta.url));
// The driver is installed once, beside the viewer.
const puppeteer = createRequire(path.join(here, '../../srrf-view/web/package.json'))('puppeteer-core');

const [executablePath, report, folder] = process.argv.slice(2);
const browser = await puppeteer.launch({
  executablePath,
  args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--force-color-profile=srgb'],
});

async function open({ scheme = 'light', width = 1280, height = 900 } = {}) {
  const page = await browser.newPage();
  const complaints = [];
  const address = pathToFileURL(report).href;
  page.on('console', (m) => ['error', 'warn', 'assert'].includes(m.type()) && complaints.push(`${m.type()}: ${m.text()}`));
  page.on('pageerror', (e) => complaints.push(`exception: ${e.message}`));
  page.on('request', (r) => {
    if (r.url() !== address && !r.url().startsWith('data:')) complaints.push(`request: ${r.url()}`);
  });
  await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: scheme }]);
  await page.setViewport({ width, height });
  await page.goto(address);
  return { page, complaints };
}

const shot = (page, name) => page.screenshot({ path: path.join(folder, `${name}.png`) });

/** The numbers of a column of a table, without those that are missing. */
const column = (page, table, index) =>
  page.$eval(
    `#${table}`,
    (sheet, i) => [...sheet.querySelectorAll('tbody tr')].map((row) => row.cells[i].dataset.v).filter((v) => v !== '').map(Number),
    index,
  );

async function sorts(page) {
  const table = (await page.$('#table3')) ? 'table3' : 'table1';
  const head = `#${table} th:nth-child(4) button`; // RMSE(R)
  const before = await column(page, table, 3);
  const ordered = (values, sign) => values.every((v, i) => i === 0 || sign * (v - values[i - 1]) >= 0);
  assert.ok(before.length > 3 && !ordered(before, 1), 'the table is in order before it is sorted');
  await page.$eval(head, (e) => e.scrollIntoView({ block: 'center' }));
  await page.click(head);
  const rising = await column(page, table, 3);
  assert.ok(ordered(rising, 1), `not sorted: ${rising}`);
  assert.deepEqual([...rising].sort(), [...before].sort(), 'sorting lost a row');
  assert.equal(await page.$eval(`#${table} th:nth-child(4)`, (e) => e.getAttribute('aria-sort')), 'ascending');
  await shot(page, 'sorted');
  await page.click(head);
  assert.ok(ordered(await column(page, table, 3), -1), 'a second click does not turn the order round');
  await page.focus(`#${table} th:nth-child(2) button`);
  await page.keyboard.press('Enter');
  const names = await page.$eval(`#${table}`, (s) => [...s.querySelectorAll('tbody tr')].map((r) => r.cells[1].textContent));
  assert.deepEqual(names, [...names].sort((a, b) => a.localeCompare(b)), 'words are not sorted by the keyboard');
}

async function settle(page) {
  const frames = () => page.$eval('.srrf-view', (e) => Number(e.dataset.frames ?? 0));
  for (let last = -1, now = 0; last !== now; ) {
    last = now;
    await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
    now = await frames();
  }
}

async function turns(page) {
  const picture = async () => {
    await settle(page);
    return page.$eval('.srrf-view', (view) => view.srrfView.scene.snapshot());
  };
  await page.$eval('#pairs', (e) => e.scrollIntoView());
  await page.waitForFunction(() => Number(document.querySelector('.srrf-view').dataset.frames) > 0, { timeout: 60000 });
  const before = await picture();
  await shot(page, 'view');
  const box = await (await page.$('.sv-stage canvas')).boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 120, y + 30, { steps: 4 });
  await page.mouse.up();
  const turned = await picture();
  assert.notEqual(turned, before, 'a drag does not turn the view');
  const poses = await page.$$eval('.sv-bar select option', (all) => all.map((e) => e.textContent));
  assert.ok(poses.length > 2, `poses: ${poses}`);
  await shot(page, 'view-turned');
}

const { page, complaints } = await open();
await shot(page, 'top');
const opening = await page.$eval('main > section', (e) => e.id);
assert.notEqual(opening, 'losses', 'the report opens with results');
const misplaced = await page.$$eval('.sheet table', (tables) => tables.flatMap((table) =>
  [...table.tHead.rows[0].cells].filter((head, i) => {
    const cell = table.tBodies[0].rows[0]?.cells[i];
    return cell && getComputedStyle(cell).textAlign === 'right' && getComputedStyle(head.firstElementChild).textAlign !== 'right';
  }).map((head) => head.textContent)));
assert.deepEqual(misplaced, [], 'heads of numbers stand over their numbers');
await sorts(page);
await turns(page);
for (const id of ['losses', 'severity', 'pictures', 'table4', 'ablations']) {
  const there = await page.$(`#${id}`);
  if (!there) continue;
  await page.$eval(`#${id}`, (e) => e.scrollIntoView());
  await shot(page, id);
}
assert.deepEqual(complaints, []);
await page.close();

for (const width of [390]) {
  const narrow = await open({ scheme: 'dark', width, height: 800 });
  await narrow.page.$eval('#tables', (e) => e.scrollIntoView());
  const fits = await narrow.page.evaluate(() => document.documentElement.scrollWidth <= document.documentElement.clientWidth);
  assert.ok(fits, `the page is wider than ${width} pixels`);
  await shot(narrow.page, 'narrow-dark');
  assert.deepEqual(narrow.complaints, []);
  await narrow.page.close();
}
await browser.close();
console.log('the report: everything works');
