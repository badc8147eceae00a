// Clips in a real browser: by a clock of our own it shows every frame when it is due, in a loop, and stores how long each stood;
// where the clock stumbles it says which frames were never drawn. By the browser's own clock a trial goes to its end.
// usage: LULL_STUDY=… CHROMIUM=… node clips.mjs FOLDER
import fs from 'node:fs';
import path from 'node:path';
import { chromium } from 'playwright-core';
import { Looker } from './look.mjs';
import { Client, Server, check, finish, lullStudy, makeClip } from './support.mjs';

const root = process.argv[2],
    FRAMES = 12,
    SHOWN = 24, // two loops
    LEVELS = [16, 64, 256, 1024];
fs.rmSync(root, { recursive: true, force: true });
fs.mkdirSync(path.join(root, 'shots'), { recursive: true });
makeClip(path.join(root, 'walk'), 200, 200, LEVELS, FRAMES);
const dir = path.join(root, 'study');
lullStudy('init', dir, '--task', 'thresholds', '--method', '2ifc', '--views', path.join(root, 'walk'), '--trials', '10', '--gap', '40', '--catch', '0');
const server = await new Server(dir).start();
const browser = await chromium.launch({ executablePath: process.env.CHROMIUM, args: ['--no-sandbox'] });
const looker = new Looker(browser, path.join(root, 'shots')),
    errors = [];

// A screen of 60 Hz whose clock runs as the test wants, and what is drawn on the canvas of the trial.
function ownClock() {
    const clock = { now: 1000, drawn: [], stumbleAt: -1, holdAt: -1, waiting: null };
    window.clock = clock;
    window.requestAnimationFrame = (f) => {
        const tick = () => {
            clock.now += clock.drawn.length === clock.stumbleAt ? 125 : 1000 / 60;
            if (clock.drawn.length === clock.stumbleAt) clock.stumbleAt = -1;
            f(clock.now);
        };
        if (clock.drawn.length === clock.holdAt) clock.waiting = tick;
        else setTimeout(tick, 0);
        return 0;
    };
    const draw = CanvasRenderingContext2D.prototype.drawImage;
    CanvasRenderingContext2D.prototype.drawImage = function (strip, ...at) {
        if (at.length === 8) clock.drawn.push(at[1] / at[3]);
        return draw.call(this, strip, ...at);
    };
}

// A page that stands before its first trial.
async function open(clock) {
    const client = new Client(server.link),
        { body } = await client.post('api/people', { consent: true });
    await client.post(`api/people/${body.key}/profile`, { answers: {}, screen: {} });
    client.close();
    const viewport = { width: 1280, height: 800 };
    const context = await browser.newContext({ viewport, screen: viewport });
    context.setDefaultTimeout(0); // LIMIT_S of tests/run is the limit
    if (clock) await context.addInitScript(ownClock);
    const page = await context.newPage();
    page.on('pageerror', (e) => errors.push(e.message));
    await page.goto(`${server.link}?p=${body.key}`);
    await page.getByRole('button', { name: 'Start' }).waitFor();
    return { page, id: body.id };
}
const state = (page, name) => page.waitForFunction((n) => document.body.dataset.state === n, name, { polling: 50 });

async function answer(page) {
    await state(page, 'asking');
    await page.keyboard.press('1');
    await page.waitForFunction(() => document.body.dataset.state !== 'asking', undefined, { polling: 5 });
}
function times(id) {
    lullStudy('export', dir, '-o', path.join(root, 'trials.json'));
    const { people } = JSON.parse(fs.readFileSync(path.join(root, 'trials.json'), 'utf8'));
    return people.find((p) => p.id === id).trials.map((t) => t.frame_ms.split(' ').map(Number));
}

const { page, id } = await open(true);
await looker.look(page, 'instructions', ['Which one has errors?', 'grain, blotches, flicker', 'Start']);
await page.evaluate(() => (window.clock.holdAt = 6)); // five frames are drawn before, from the first on
await page.getByRole('button', { name: 'Start' }).click();
await page.waitForFunction(() => window.clock.waiting, undefined, { polling: 50 });
await looker.look(page, 'frame', ['first'], 1);
await page.evaluate(() => {
    window.clock.holdAt = -1;
    window.clock.waiting();
});
await state(page, 'asking');
await looker.look(page, 'asking', ['Which one had errors?', '1  first', 'second  2']);
const drawn = await page.evaluate(() => window.clock.drawn);
const loop = Array.from({ length: 2 * SHOWN }, (_, i) => (i % SHOWN) % FRAMES);
check(drawn.join() === loop.join(), 'two intervals of two loops, every frame once and in order', drawn);
await page.evaluate(() => {
    window.clock.drawn = [];
    window.clock.stumbleAt = 30; // of the second interval the sixth frame stands too long
});
await answer(page);
await state(page, 'asking');
const stumbled = await page.evaluate(() => window.clock.drawn);
await answer(page);
await state(page, 'asking'); // what was answered is stored
const [even, uneven] = times(id);
const pulled = Array.from({ length: 2 * SHOWN }, (_, i) => (i % 2 ? 33 : 50)).join(' '); // 24 of 60 Hz: three refreshes, then two
check(even.join(' ') === pulled, 'how long each frame stood is stored: 50 and 33 ms in turn', even);
const skipped = uneven.flatMap((ms, i) => (ms === 0 ? [i] : []));
check(skipped.length > 0 && skipped.every((i) => i > 29 && i < 34), 'frames that were never drawn are 0', uneven);
check(uneven[29] >= 125, 'the one before stood longer', uneven);
check(stumbled.length === 2 * SHOWN - skipped.length, 'and were indeed not drawn', stumbled);
await page.context().close();

const own = await open(false);
await own.page.getByRole('button', { name: 'Start' }).click();
await answer(own.page);
await state(own.page, 'asking');
const [seen] = times(own.id);
const late = seen.filter((ms) => ms === 0).length;
console.log(`# by the browser's own clock: ${late} of ${seen.length} frames dropped, ${seen.join(' ')}`);
const sum = seen.slice(0, SHOWN).reduce((a, b) => a + b);
check(seen.length === 2 * SHOWN && sum > 950, "a trial by the browser's own clock: all times are there, and make two loops", sum);
await own.page.context().close();
await server.stop();
const report = lullStudy('report', dir, '--no-pictures');
check(/^[1-9]\d* answers to clips with a frame that the screen never showed/m.test(report), 'the report says how many trials stumbled', report);
check(errors.length === 0, 'no errors in the browser', errors.join('\n'));
await browser.close();
finish();
