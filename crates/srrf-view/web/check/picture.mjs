// One picture of a page of `srrf register --html`: before on the left, the result on the right.
// node picture.mjs CHROMIUM PAGE.html OUT.png
import { readFileSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import puppeteer from 'puppeteer-core';

const [executablePath, from, to] = process.argv.slice(2);
const browser = await puppeteer.launch({
  executablePath,
  args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--force-color-profile=srgb'],
});
const page = await browser.newPage();
await page.setViewport({ width: 980, height: 480 });
await page.goto(pathToFileURL(path.resolve(from)).href);
await page.waitForFunction(() => Number(document.querySelector('.srrf-view').dataset.frames) > 0, { timeout: 60000 });
const still = () => page.evaluate(() => new Promise((done) => setTimeout(done, 1500)));
await still();
const stage = await page.$('.sv-stage canvas');
const after = await stage.screenshot({ encoding: 'base64' });
await page.click('.sv-bar > button');
await page.waitForFunction(() => document.querySelector('.sv-slide input').value === '0');
await still();
const before = await stage.screenshot({ encoding: 'base64' });
await page.setViewport({ width: 1200, height: 366 });
await page.setContent(`<body style="margin:0;display:flex;background:#fff;font:600 18px system-ui,sans-serif;color:#1b1f24">
  ${[['two scans', before], ['srrf register', after]]
    .map(([name, image]) => `<figure style="margin:0;flex:1;text-align:center"><img style="width:600px" src="data:image/png;base64,${image}"><figcaption>${name}</figcaption></figure>`)
    .join('')}</body>`);
await still();
writeFileSync(to, await page.screenshot());
console.log(`${to}: ${readFileSync(to).length} bytes`);
await browser.close();
