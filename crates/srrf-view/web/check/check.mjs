// Uses pages as a reader would, in a headless Chromium with software WebGL.
// node check.mjs CHROMIUM FOLDER [PART]...: reads one.html, gallery.html, large.html and far.html
// there, writes screenshots beside them. All parts by default.

import assert from 'node:assert/strict';
import { readFileSync, statSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import puppeteer from 'puppeteer-core';

const [executablePath, folder, ...wanted] = process.argv.slice(2);
const launch = (...extra) =>
  puppeteer.launch({
    executablePath,
    args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--force-color-profile=srgb', ...extra],
  });

/** Opens a page; whatever it says on the console or asks of the network ends up in `complaints`. */
async function open(browser, name, { scheme = 'light', width = 1280, height = 800, touch = false } = {}) {
  const page = await browser.newPage();
  const complaints = [];
  const address = pathToFileURL(path.join(folder, name)).href;
  page.on('console', (m) => ['error', 'warn', 'assert'].includes(m.type()) && complaints.push(`${m.type()}: ${m.text()}`));
  page.on('pageerror', (e) => complaints.push(`exception: ${e.message}`));
  page.on('request', (r) => {
    if (r.url() !== address && !r.url().startsWith('data:')) complaints.push(`request: ${r.url()}`);
  });
  await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: scheme }]);
  await page.setViewport({ width, height, hasTouch: touch, isMobile: touch, deviceScaleFactor: touch ? 2 : 1 });
  const before = performance.now();
  await page.goto(address);
  return { page, complaints, before };
}

const frames = (page) => page.$eval('.srrf-view', (e) => Number(e.dataset.frames ?? 0));

/** Lets the page draw what it has to. */
async function settle(page) {
  for (let last = -1, now = 0; last !== now; ) {
    last = now;
    await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
    now = await frames(page);
  }
}

async function firstFrame(page) {
  await page.waitForFunction(() => Number(document.querySelector('.srrf-view').dataset.frames) > 0, { timeout: 60000 });
  await settle(page);
}

/** The pixels of the picture alone, without what lies over it. */
const picture = async (page) => {
  await settle(page);
  return page.$eval('.srrf-view', (view) => view.srrfView.scene.snapshot());
};

/** Does something and requires that the picture changes (or stays). */
async function changes(page, what, act, expected = true) {
  const before = await picture(page);
  await act();
  const after = await picture(page);
  assert.equal(before !== after, expected, `${what}: the picture ${expected ? 'did not change' : 'changed'}`);
}

async function setRange(page, selector, value) {
  await page.$eval(
    selector,
    (e, v) => {
      e.value = v;
      e.dispatchEvent(new Event('input', { bubbles: true }));
    },
    value,
  );
}

const shot = async (page, name, options = {}) => {
  await settle(page);
  await page.screenshot({ path: path.join(folder, `${name}.png`), ...options });
};

async function drag(page) {
  const box = await (await page.$('.sv-stage canvas')).boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 120, y + 30, { steps: 4 });
  await page.mouse.up();
}

async function pinAndTurn(page) {
  const box = await (await page.$('.sv-stage canvas')).boundingBox();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.touchscreen.touchStart(x, y);
  for (let i = 1; i <= 5; i++) await page.touchscreen.touchMove(x + 20 * i, y);
  await page.touchscreen.touchEnd();
}

const noSideways = (page) =>
  page.evaluate(() => document.documentElement.scrollWidth <= document.documentElement.clientWidth);

/** Each cloud is on the picture, to its last point. */
const wholeClouds = (page) =>
  page.$eval('.srrf-view', (view) => {
    const { scene } = view.srrfView;
    const shown = [[scene.positions.target, scene.target], [scene.positions.source, scene.source]];
    return shown.map(([position, cloud]) => {
      cloud.updateWorldMatrix(true, false);
      const point = scene.camera.position.clone();
      let outermost = 0;
      for (let i = 0; i < position.length; i += 3) {
        point.fromArray(position, i).applyMatrix4(cloud.matrixWorld).project(scene.camera);
        outermost = Math.max(outermost, Math.abs(point.x), Math.abs(point.y));
      }
      return outermost;
    });
  });

/** What is written beside the picture is whole: words in one piece, tables not cut. */
async function wellSet(page) {
  const broken = await page.$$eval('.sv-facts dt, .sv-facts dd, .sv-side th', (all) => all.filter((e) => {
    const range = document.createRange();
    for (const node of [...e.childNodes].filter((n) => n.nodeType === 3)) {
      for (const { index, 0: word } of node.textContent.matchAll(/\S+/g)) {
        range.setStart(node, index);
        range.setEnd(node, index + word.length);
        if (new Set([...range.getClientRects()].map((r) => Math.round(r.top))).size > 1) return true;
      }
    }
    return false;
  }).map((e) => e.textContent));
  assert.deepEqual(broken, [], 'words are broken');
  const cut = await page.$$eval('.sv-scroll', (all) => all.filter((e) => e.scrollWidth > e.clientWidth + 1).length);
  assert.equal(cut, 0, 'a table is cut at the right');
}

async function everythingOnOnePage(browser) {
  const { page, complaints } = await open(browser, 'one.html');
  await firstFrame(page);
  await shot(page, '1-opens');
  for (const outermost of await wholeClouds(page)) {
    assert.ok(outermost < 1 && outermost > 0.3, `the first view reaches to ${outermost}`);
  }
  await wellSet(page);
  const tone = await page.$eval('.sv-facts .sv-good', (e) => getComputedStyle(e).color);
  assert.equal(tone, 'rgb(10, 107, 71)', 'the verdict has its colour');
  await changes(page, 'nothing', async () => {}, false);
  await changes(page, 'a drag', () => drag(page));
  await changes(page, 'the wheel', () => page.mouse.wheel({ deltaY: -300 }));

  const layers = await page.$$eval('.sv-check input[type=checkbox]', (all) => all.map((e) => e.name));
  assert.deepEqual(layers, ['ghost', 'source', 'target', 'skeletons', 'matches']);
  for (const layer of layers) {
    for (const time of ['first', 'second']) {
      await changes(page, `layer ${layer}, ${time} click`, () => page.click(`.sv-check input[name=${layer}]`));
    }
  }
  await changes(page, 'showing before', async () => {
    await page.click('.sv-bar > button');
    await page.waitForFunction(() => document.querySelector('.sv-slide input').value === '0');
  });
  await shot(page, '2-before');
  await changes(page, 'the slider', () => setRange(page, '.sv-slide input', 0.5));
  await changes(page, 'the end of the slider', () => setRange(page, '.sv-slide input', 1));

  await changes(page, 'another pose', () => page.select('.sv-bar select', '2'));
  await shot(page, '3-upside-down');
  await changes(page, 'a pose chosen in the table', () => page.click('.sv-side tbody tr:nth-child(2) button'));
  assert.equal(await page.$eval('.sv-bar select', (e) => e.value), '0');

  await changes(page, 'colour by distance', () => page.click('input[value=residual]'));
  assert.match(await page.$eval('.sv-legend', (e) => e.textContent), /Distance to the target \(after: result\)/);
  await changes(page, 'the range of the colours', () => setRange(page, '.sv-side fieldset input[step="0.005"]', 0.2));
  await page.select('.sv-bar select', '1');
  await shot(page, '4-distance');
  await changes(page, 'the colours of the points', () => page.click('input[value=colours]'));
  await shot(page, '4-colours');
  await changes(page, 'intensity', () => page.click('input[value=intensities]'));
  await page.click('input[value=residual]');
  await changes(page, 'the size of the points', () => setRange(page, '.sv-side input[max="10"]', 9));
  await setRange(page, '.sv-side input[max="10"]', 4);
  await page.click('input[value=cloud]');
  for (const layer of ['skeletons', 'matches', 'ghost']) await page.click(`.sv-check input[name=${layer}]`);
  await page.select('.sv-bar select', '0');
  await shot(page, '5-all-layers');

  await page.focus('.sv-stage canvas');
  for (const key of ['ArrowLeft', 'ArrowUp', '+', '-', 'f']) await changes(page, `key ${key}`, () => page.keyboard.press(key));
  const unnamed = await page.$$eval('button, input, select, canvas', (all) =>
    all.filter((e) => !(e.labels?.length || e.textContent.trim() || e.getAttribute('aria-label'))).map((e) => e.outerHTML));
  assert.deepEqual(unnamed, []);
  const words = await page.$eval('canvas', (e) => document.getElementById(e.getAttribute('aria-describedby')).textContent);
  assert.match(words, /The pose “result” turns the source by .* degrees/);

  await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: 'dark' }]);
  await shot(page, '6-dark');
  await page.click('input[value=residual]');
  await page.select('.sv-bar select', '1');
  await shot(page, '7-dark-distance');
  assert.deepEqual(complaints, []);
  await page.close();
}

async function onAPhone(browser) {
  for (const width of [360, 320]) {
    const { page, complaints } = await open(browser, 'one.html', { width, height: 740, touch: true });
    await firstFrame(page);
    assert.ok(await noSideways(page), `the page is wider than ${width} pixels`);
    await wellSet(page);
    await changes(page, 'a finger', () => pinAndTurn(page));
    await shot(page, `8-phone-${width}`);
    await shot(page, `8-phone-${width}-whole`, { fullPage: true });
    const small = await page.$$eval('button, select, .sv-check', (all) => all.filter((e) => e.offsetHeight > 0 && e.offsetHeight < 26).length);
    assert.equal(small, 0, 'a control is too small for a finger');
    assert.deepEqual(complaints, []);
    await page.close();
  }
  // From wide to narrow, without opening anew.
  const { page, complaints } = await open(browser, 'one.html');
  await firstFrame(page);
  await changes(page, 'a narrow window', () => page.setViewport({ width: 390, height: 844 }));
  assert.ok(await noSideways(page));
  assert.deepEqual(complaints, []);
  await page.close();
}

async function severalPairs(browser) {
  const { page, complaints } = await open(browser, 'gallery.html');
  await firstFrame(page);
  assert.equal(await page.$$eval('.sv-side select', (all) => all[0].options.length), 4);
  await changes(page, 'another pair', () => page.select('.sv-side select', '1'));
  await shot(page, '9-gallery');
  await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: 'dark' }]);
  await page.select('.sv-side select', '3');
  await page.click('.sv-check input[name=matches]');
  await setRange(page, '.sv-slide input', 0.5);
  await shot(page, '9-gallery-dark');
  assert.deepEqual(complaints, []);
  await page.close();
}

async function twoMillionPoints(browser) {
  const bytes = statSync(path.join(folder, 'large.html')).size;
  assert.ok(bytes < 10e6, `${bytes} bytes`);
  const { page, complaints, before } = await open(browser, 'large.html');
  await firstFrame(page);
  console.log(`2 million points: ${(bytes / 1e6).toFixed(1)} MB, first frame after ${((performance.now() - before) / 1000).toFixed(1)} s`);
  assert.match(await page.$eval('.sv-legend', (e) => e.textContent), /Showing 120,000 of 2,000,000 source points/);
  await changes(page, 'a drag', () => drag(page));
  await shot(page, '10-two-million');
  await page.click('input[value=residual]');
  await page.select('.sv-bar select', '1');
  await shot(page, '10-two-million-distance');
  assert.deepEqual(complaints, []);
  await page.close();
}

async function farApart(browser) {
  const { page, complaints } = await open(browser, 'far.html');
  await firstFrame(page);
  assert.equal(await page.$eval('.sv-status', (e) => e.hidden), true);
  await setRange(page, '.sv-slide input', 0);
  assert.match(await page.$eval('.sv-status', (e) => e.textContent), /lies .* away from the target; “Fit” shows both/);
  await changes(page, 'fit', () => page.evaluate(() => [...document.querySelectorAll('button')].find((b) => b.textContent === 'Fit').click()));
  await setRange(page, '.sv-slide input', 1);
  await page.evaluate(() => [...document.querySelectorAll('button')].find((b) => b.textContent === 'Fit').click());
  await shot(page, '11-survey-coordinates');
  assert.deepEqual(complaints, []);
  await page.close();
}

/** Two views in a long page of another make, as a report has them: the second waits until it is near. */
async function embedded(browser) {
  const whole = readFileSync(path.join(folder, 'one.html'), 'utf8');
  const [element, script] = [/<section class="srrf-view"[\s\S]*?<\/section>/, /<script>[\s\S]*<\/script>/].map((r) => whole.match(r)[0]);
  const gap = '<p style="height:3000px">…</p>';
  const body = `<h1>Report</h1>${element}${gap}${element.replace('id="view"', 'id="second"')}${gap}${script}`;
  writeFileSync(path.join(folder, 'embedded.html'), `<!doctype html><meta charset="utf-8"><title>r</title>${body}`);
  const { page, complaints } = await open(browser, 'embedded.html');
  await firstFrame(page);
  assert.equal(await page.$eval('#second', (e) => e.dataset.frames), undefined);
  await changes(page, 'a drag', () => drag(page));
  await page.click('h1');
  const box = await (await page.$('.sv-stage canvas')).boundingBox();
  await page.mouse.move(box.x + 50, box.y + 50);
  await page.evaluate(() => document.activeElement.blur());
  await changes(page, 'the wheel of a scrolling page', () => page.mouse.wheel({ deltaY: 200 }), false);
  await page.$eval('#second', (e) => e.scrollIntoView());
  await page.waitForFunction(() => Number(document.querySelector('#second').dataset.frames) > 0, { timeout: 60000 });
  await shot(page, '13-embedded');
  const ids = await page.$$eval('[id]', (all) => all.map((e) => e.id));
  assert.equal(new Set(ids).size, ids.length, 'ids are unique');
  assert.deepEqual(complaints, []);
  await page.close();
}

async function withoutWebgl() {
  const browser = await launch('--disable-3d-apis');
  const { page, complaints } = await open(browser, 'one.html', { width: 900 });
  await page.waitForSelector('.sv-fault');
  assert.match(await page.$eval('.sv-fault', (e) => e.textContent), /WebGL 2 is missing or switched off/);
  assert.ok((await page.$$('.sv-side tbody tr')).length > 1, 'the figures are there');
  assert.equal(await page.$eval('.sv-bar', (e) => e.hidden), true);
  await page.screenshot({ path: path.join(folder, '12-no-webgl.png') });
  assert.deepEqual(complaints, []);
  await browser.close();
}

async function withoutScript(browser) {
  const page = await browser.newPage();
  await page.setJavaScriptEnabled(false);
  await page.goto(pathToFileURL(path.join(folder, 'one.html')).href);
  assert.match(await page.$eval('body', (e) => e.innerText), /The 3D view needs JavaScript[\s\S]*The pose “result”/);
  await page.close();
}

const parts = { everythingOnOnePage, onAPhone, severalPairs, twoMillionPoints, farApart, embedded, withoutScript, withoutWebgl };
const browser = await launch();
try {
  for (const [name, part] of Object.entries(parts)) {
    if (wanted.length > 0 && !wanted.includes(name)) continue;
    await part(browser);
    console.log(`passed: ${name}`);
  }
} finally {
  await browser.close();
}
