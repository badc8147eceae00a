// The page that lull-render --html writes, at the width of a desk's screen and of a phone: slider, layers, blocks by mouse, finger and
// keys, escapes, no request to anywhere.
// usage: CHROMIUM=… node page.mjs FOLDER SCENE
import fs from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import { chromium } from 'playwright-core';
import { check, finish } from './support.mjs';

const [folder, scene] = process.argv.slice(2);
const browser = await chromium.launch({ executablePath: process.env.CHROMIUM, args: ['--no-sandbox'] });
const outside = [],
    errors = [];

async function open(name, options) {
    const page = await (await browser.newContext(options)).newPage();
    page.on('request', (r) => /^(file|data):/.test(r.url()) || outside.push(r.url()));
    page.on('pageerror', (e) => errors.push(e.message));
    page.on('console', (m) => m.type() === 'error' && errors.push(m.text()));
    await page.goto(pathToFileURL(path.join(folder, name)).href);
    return page;
}
const report = (name) => JSON.parse(fs.readFileSync(path.join(folder, name), 'utf8'));
const clip = (page, selector) => page.$eval(selector, (e) => e.style.clipPath.match(/[\d.]+(?=%)/)?.[0]);
const card = (page) => page.locator('#block').innerText();
async function pointAt(page, block, click) {
    const r = report('page.json'), box = await page.locator('#view').boundingBox();
    const x = box.x + (box.width * (block.x0 + block.x1)) / 2 / r.width, y = box.y + (box.height * (block.y0 + block.y1)) / 2 / r.height;
    await (click ? page.mouse.click(x, y) : page.mouse.move(x, y));
}

for (const [name, options] of [
    ['wide', { viewport: { width: 1280, height: 800 }, colorScheme: 'light' }],
    ['phone', { viewport: { width: 390, height: 844 }, colorScheme: 'dark' }],
]) {
    const page = await open('page.html', options), r = report('page.json');
    check((await page.locator('h1').innerText()) === scene && (await page.title()).startsWith(scene), `${name}: the scene's name is text`, await page.title());
    check((await page.locator('b[onclick]').count()) === 0, `${name}: and makes no element`);
    const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    check(wide <= 0, `${name}: nothing reaches beyond the screen`, wide);
    const box = await page.locator('#view').boundingBox(), slider = await page.locator('#slider').boundingBox();
    check(box.width > 300 && slider.y + slider.height <= options.viewport.height, `${name}: picture and slider fit on the screen`, JSON.stringify([box, slider]));
    const b = r.blocks[9];
    await pointAt(page, b, name === 'phone');
    const text = await card(page);
    check(text.includes(`Block ${b.id}`) && text.includes(b.spp.toLocaleString('en')) && text.includes('Price per path'), `${name}: a block tells its numbers`, text);
    const price = ((1e6 * b.thread_s) / (400 * b.spp)).toLocaleString('en', { maximumSignificantDigits: 3 });
    check(text.includes(`${price} µs`), `${name}: its price per path`, `${price}: ${text}`);
    check((await page.locator('#history circle').count()) === r.history[9].length, `${name}: and its history, a point for each check`);
    await page.screenshot({ path: path.join(folder, `${name}.png`), fullPage: true });
    await page.locator('#slider').focus();
    await page.keyboard.press('Home');
    check((await clip(page, '#map')) === '0', `${name}: the slider's keys: the map alone`, await clip(page, '#map'));
    await page.keyboard.press('End');
    check((await clip(page, '#map')) === '100', `${name}: the picture alone`);
    await page.keyboard.press('ArrowLeft');
    check(Number(await clip(page, '#map')) < 100, `${name}: and between`);
    await page.keyboard.press('2');
    check((await page.locator('#right-tag').textContent()) === 'Error' && (await page.locator('input[value=error]').isChecked()), `${name}: a digit chooses a layer`);
    const least = Math.min(...r.blocks.map((k) => k.error));
    const told = least >= 100 ? Math.round(least).toLocaleString('en') : least.toLocaleString('en', { maximumSignificantDigits: 3 });
    check((await page.locator('#legend').innerText()).startsWith(told), `${name}: the legend begins at the least error`, await page.locator('#legend').innerText());
    await page.locator('#view').focus();
    await page.keyboard.press('ArrowRight');
    check((await card(page)).includes('Block 10'), `${name}: arrows go from block to block`, await card(page));
    await page.keyboard.press('ArrowDown');
    check((await card(page)).includes('Block 16'), `${name}: and to the next row`, await card(page));
    const dear = [...r.blocks].sort((p, q) => q.thread_s - p.thread_s)[0];
    const first = page.locator('table button').first();
    check((await first.innerText()) === String(dear.id), `${name}: the most expensive block comes first`);
    await first.focus();
    await page.keyboard.press('Enter');
    check((await card(page)).includes(`Block ${dear.id}\n`), `${name}: which can be gone to`, await card(page));
    const body = await page.locator('main').innerText();
    const missing = ['--spp-max 96', r.software, r.processor ?? '', '--visible 0.35', 'Seed'].filter((w) => !body.includes(w));
    check(missing.length === 0, `${name}: where it was made and how good`, missing);
}

const page = await open('page--denoise.html', { viewport: { width: 1280, height: 800 } });
const choices = await page.locator('#choices span').allInnerTexts();
check(choices.join() === 'Samples,Error,Time,Price,Noisy,Denoised', 'a denoised picture has its layers', choices);
await page.locator('#choices span', { hasText: 'Noisy' }).click();
check(await page.locator('img[data-layer=noisy]').isVisible() && !(await page.locator('img[data-layer=denoised]').isVisible()) &&
    (await clip(page, 'img[data-layer=noisy]')) === '50', 'one of them stands right of the slider');
check(await page.locator('img[data-layer=picture]').evaluate((i) => i.naturalWidth === 120 && i.naturalHeight === 80), 'pictures are read');
check(errors.length === 0, 'no error on any page', errors.join('\n'));
check(outside.length === 0, 'no request leaves the page', outside.join('\n'));
await browser.close();
finish();
