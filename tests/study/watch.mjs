// The page of `python3 -m lull watch`: it waits for a report, follows a render without being loaded again, says when nothing comes any more,
// and is the page of --html at the end.
// usage: CHROMIUM=… LULL_RENDER=… PYTHONPATH=… node watch.mjs FOLDER SCENE
import { spawn } from 'node:child_process';
import fs from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import { chromium } from 'playwright-core';
import { check, finish } from './support.mjs';

const PATIENCE = 120000; // ms: other programs run beside it
const [folder, scene] = process.argv.slice(2);
const at = (name) => path.join(folder, name);
const server = spawn('python3', ['-m', 'lull', 'watch', folder], { stdio: ['ignore', 'pipe', 'inherit'] });
process.once('exit', () => server.kill('SIGKILL'));
const address = await new Promise((resolve) => server.stdout.once('data', (d) => resolve(String(d).trim())));
const browser = await chromium.launch({ executablePath: process.env.CHROMIUM, args: ['--no-sandbox'] });
const page = await (await browser.newContext({ viewport: { width: 1280, height: 900 } })).newPage();
page.setDefaultTimeout(PATIENCE);
const outside = [],
    errors = [];
page.on('request', (r) => r.url().startsWith(address) || r.url().startsWith('data:') || outside.push(r.url()));
page.on('pageerror', (e) => errors.push(e.message));
const until = async (what, name, ...args) => {
    const came = await page.waitForFunction(what, ...args).then(() => true, () => false);
    check(came, name, came ? '' : await page.locator('body').innerText());
};
const render = (...options) =>
    spawn(process.env.LULL_RENDER, [scene, '-q', '--size', '120x80', '--block', '20', '-t', '1', '--live', '--report', at('report.json'), '--preview', at('picture.png'), ...options], {
        stdio: 'inherit',
    });
const over = (child) => new Promise((resolve) => child.on('exit', resolve));

await page.goto(address);
await until(() => document.querySelector('#waiting'), 'without a report it waits');
const first = render('-c', 'null', '--spp-max', '100000000');
await until(() => document.querySelector('#done'), 'it finds the report by itself');
await until(() => document.querySelector('img[data-layer=picture]')?.naturalWidth === 120, 'and the picture');
check((await page.locator('#lead').innerText()).match(/\d+ % done at least, .* left at most: .*24 active/), 'it says how far the render is', await page.locator('#lead').innerText());
check((await page.locator('#map .active').count()) === 24, 'active blocks are framed');
await page.evaluate(() => (window.same = true));
await page.locator('#choices span', { hasText: 'Time' }).click();
await page.locator('#view').focus();
await page.keyboard.press('ArrowRight');
const samples = await page.evaluate(() => totals.samples), seen = await page.locator('img[data-layer=picture]').getAttribute('src');
await until((before) => totals.samples > before, 'samples grow', samples);
await until((before) => document.querySelector('img[data-layer=picture]').src !== before, 'the picture changes', seen);
check(await page.evaluate(() => window.same), 'without being loaded again');
check((await page.locator('#right-tag').textContent()) === 'Time' && (await page.locator('#block').innerText()).includes('Block 0'), 'layer and block stay chosen');
await page.screenshot({ path: at('going-on.png') });
first.kill('SIGKILL');
await over(first);
const old = new Date(Date.now() - 300000);
fs.utimesSync(at('report.json'), old, old);
await until(() => document.querySelector('#still').textContent.startsWith('Nothing new for'), 'a render that has died is found out');

check((await over(render('--spp-max', '96', '--html', at('page.html')))) === 0, 'a render ends');
await until(() => !report.progress && !document.querySelector('#done'), 'the page sees it');
check(await page.locator('#still').isHidden(), 'and has nothing to complain about');
const kept = await (await browser.newContext({ viewport: { width: 1280, height: 900 } })).newPage();
await kept.goto(pathToFileURL(at('page.html')).href);
await page.locator('#choices span', { hasText: 'Samples' }).click();
await page.reload();
for (const [name, what] of [['text', (p) => p.locator('main').innerText()], ['map', (p) => p.locator('#map').innerHTML()], ['pixels', (p) => p.evaluate(() => {
    const image = document.querySelector('img[data-layer=picture]'), canvas = Object.assign(document.createElement('canvas'), { width: 120, height: 80 });
    canvas.getContext('2d').drawImage(image, 0, 0);
    return canvas.toDataURL();
})]])
    check((await what(page)) === (await what(kept)), `it is the page of --html: ${name}`, `${await what(page)}\n---\n${await what(kept)}`);
await page.screenshot({ path: at('over.png') });
server.kill('SIGINT');
await until(() => document.querySelector('#still').textContent.startsWith('Nobody answers'), 'a server that has ended is told');
check(errors.length === 0, 'no error on the page', errors.join('\n'));
check(outside.length === 0, 'no request goes elsewhere', outside.join('\n'));
await browser.close();
finish();
