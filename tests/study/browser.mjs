// A real browser goes through every task to the end, at two window sizes, once with the keyboard alone; reload, a second tab,
// a lost connection and a killed server lose nothing. Every page is looked at as it stands on the screen (look.mjs), and its
// screenshot is left beside the studies.
// usage: LULL_STUDY=… CHROMIUM=… node browser.mjs FOLDER
import fs from 'node:fs';
import path from 'node:path';
import { chromium } from 'playwright-core';
import { Looker } from './look.mjs';
import { ASKED_BY, CONTACT, Client, Server, check, finish, lullStudy, makeConditions, makeLevels } from './support.mjs';

const root = process.argv[2];
const SMALL = { width: 1280, height: 800 },
    LARGE = { width: 1960, height: 1080 },
    LEAST = { width: 1000, height: 600 }; // what the page lets in; texts alone, a picture of 800 pixels is scrolled there
const SHOW_MS = 61; // of the study with two intervals
const LEVELS = [16, 32, 64, 128, 256, 512, 1024, 2048, 4096];
const outside = []; // requests that would leave this machine
const errors = [];

fs.rmSync(root, { recursive: true, force: true });
fs.mkdirSync(path.join(root, 'shots'), { recursive: true });
makeLevels(path.join(root, 'ball'), 800, 800, LEVELS);
makeLevels(path.join(root, 'small'), 400, 200, LEVELS);
makeConditions(path.join(root, 'room'), 800, 800, { lull: 2, 'fixed-64': 20 });
makeConditions(path.join(root, 'hall'), 800, 800, { lull: 1, 'fixed-64': 12 });

const browser = await chromium.launch({ executablePath: process.env.CHROMIUM, args: ['--no-sandbox'] });

async function openPage(link, viewport, options = {}) {
    const context = await browser.newContext({ viewport, screen: viewport, ...options });
    context.setDefaultTimeout(0); // LIMIT_S of tests/run is the limit
    const page = await context.newPage();
    page.on('request', (r) => {
        if (!/^(http:\/\/127\.0\.0\.1:|blob:|data:)/.test(r.url())) outside.push(r.url());
    });
    page.on('pageerror', (e) => errors.push(e.message));
    page.on('console', (m) => {
        if (m.type() === 'error' && !/ERR_|Failed to load resource/.test(m.text())) errors.push(m.text());
    });
    await page.goto(link);
    return page;
}

const looker = new Looker(browser, path.join(root, 'shots'));
const look = (...what) => looker.look(...what);
const state = (page, ...names) =>
    page.waitForFunction((n) => n.includes(document.body.dataset.state), names);
const title = (page, words) => page.getByRole('heading', { name: words }).waitFor();

// What the pages before the trials say, by task where it differs.
const CONSENT = ['A study on noise', ASKED_BY, CONTACT, 'I am at least 18', 'I agree, go on'];
const QUESTIONS = ['A few questions', 'How do you see', 'How bright is the room', 'sometimes', 'Continue'];
const CARD = ['How large is your screen', 'Hold a bank card', 'Width of the box', 'Continue'];
const DISTANCE = ['How far away do you sit', 'Distance in centimetres', 'Continue'];
const GAMMA = ['How does your screen show greys', 'Brightness of the plain field', 'Continue'];
const INSTRUCTIONS = {
    adjustment: ['Make the grain disappear', 'in 16 fields', 'Start'],
    '2ifc': ['Which one is grainy?', 'then guess', 'Start'],
    validation: ['Do they look the same?', 'S same, D different', 'Start'],
};

// Consent to instructions. shots: prefix of the screenshots.
async function enter(page, shots, task) {
    await title(page, 'A study on noise');
    await look(page, `${shots}-consent`, CONSENT);
    await page.getByRole('checkbox').check();
    await page.getByRole('button', { name: 'I agree' }).click();
    await title(page, 'A few questions');
    await page.getByRole('button', { name: 'Continue' }).click();
    await look(page, `${shots}-questions-missing`, [...QUESTIONS, 'Please answer every question']);
    for (const group of await page.locator('fieldset').all()) await group.locator('input').first().check();
    await page.getByRole('button', { name: 'Continue' }).click();
    await title(page, 'How large is your screen');
    await look(page, `${shots}-card`, CARD);
    await page.getByRole('button', { name: 'Continue' }).click();
    await title(page, 'How far away');
    await look(page, `${shots}-distance`, DISTANCE);
    await page.getByRole('button', { name: 'Continue' }).click();
    await title(page, 'How does your screen show greys');
    await page.locator('input[name=gamma]').fill('186');
    await look(page, `${shots}-gamma`, GAMMA, 2);
    await page.getByRole('button', { name: 'Continue' }).click();
    await page.getByRole('button', { name: 'Start' }).waitFor();
    await look(page, `${shots}-instructions`, INSTRUCTIONS[task]);
}

// The same with Tab, Space, arrows and Enter.
async function enterByKeys(page, shots, task) {
    await title(page, 'A study on noise');
    await look(page, `${shots}-consent`, CONSENT);
    await page.keyboard.press('Space');
    await page.keyboard.press('Enter');
    await title(page, 'A few questions');
    for (let i = 0; i < 5; i++) {
        if (i > 0) await page.keyboard.press('Tab');
        await page.keyboard.press('Space');
    }
    await look(page, `${shots}-questions`, QUESTIONS);
    await page.keyboard.press('Enter');
    await title(page, 'How large is your screen');
    await page.keyboard.press('ArrowRight');
    await look(page, `${shots}-card`, CARD);
    await page.keyboard.press('Enter');
    await title(page, 'How far away');
    await look(page, `${shots}-distance`, DISTANCE);
    await page.keyboard.press('Enter');
    await title(page, 'How does your screen show greys');
    for (let i = 0; i < 58; i++) await page.keyboard.press('ArrowRight');
    await look(page, `${shots}-gamma`, GAMMA, 2);
    await page.keyboard.press('Enter');
    await page.getByRole('button', { name: 'Start' }).waitFor();
    await look(page, `${shots}-instructions`, INSTRUCTIONS[task]);
    await page.keyboard.press('Enter');
}

// The last page, with the code for deletion, as it comes and after a reload.
async function thanked(page, server, shots) {
    await state(page, 'finished');
    const { id } = await stored(server, keyOf(page));
    const words = ['Thank you', `Your code is ${id}`, ASKED_BY, CONTACT];
    await page.waitForTimeout(50); // what would empty the page comes after
    await look(page, `${shots}-thanks`, words);
    await page.reload();
    await state(page, 'finished');
    await look(page, `${shots}-thanks-again`, words);
}

const keyOf = (page) => new URL(page.url()).searchParams.get('p');
const stored = async (server, key) => (await new Client(server.link).get(`api/people/${key}`)).body;

async function study(name, ...args) {
    const dir = path.join(root, name);
    lullStudy('init', dir, ...args);
    return new Server(dir).start();
}

// --- adjustment ---

async function adjustByMouse(page, server, shots) {
    await page.getByRole('button', { name: 'Start' }).click();
    await state(page, 'asking');
    const canvas = page.locator('canvas').first();
    const box = await canvas.boundingBox();
    const at = (i) => [box.x + 100 + 200 * (i % 4), box.y + 100 + 200 * Math.floor(i / 4)];
    for (let i = 0; i < 16; i++) {
        await page.mouse.move(...at(i));
        for (let k = 0; k < 3; k++) await page.mouse.wheel(0, i % 2 ? 120 : -120);
        if (i === 5) await look(page, `${shots}-adjustment`, ['Picture 1 of 1', 'Fields left to set: 11', 'choose a field'], 1);
        await page.mouse.click(...at(i));
        await page.waitForFunction((n) => document.querySelectorAll('.map .done').length === n, i + 1);
        if (i === 7) {
            // in the middle: what was set is there after a reload
            await page.reload();
            await page.getByRole('button', { name: 'Start' }).click();
            await state(page, 'asking');
            check((await page.locator('.map .done').count()) === 8, 'adjustment: a reload keeps the settings');
        }
    }
    const before = await stored(server, keyOf(page));
    await page.mouse.move(...at(3)); // set once more: kept as a second revision
    for (let k = 0; k < 9; k++) await page.mouse.wheel(0, -120);
    await page.mouse.click(...at(3));
    await page.waitForTimeout(300);
    const after = await stored(server, keyOf(page));
    check(
        before.trials.length === 16 &&
            after.trials.length === 17 &&
            after.trials.some((t) => t.slot === 3 && t.revision === 1 && t.level === 4096),
        'adjustment: a field set again is a second revision',
        JSON.stringify([before.trials.length, after.trials.length]),
    );
    await look(page, `${shots}-adjustment-done`, ['Fields left to set: 0', 'Next picture'], 1);
    await page.getByRole('button', { name: 'Next picture' }).click();
    await thanked(page, server, shots);
}

// Where the pointer comes to a field its outline is drawn, in the picture and in the one beside, and goes away.
async function outlined(page, shots, pictures) {
    const canvases = await page.locator('.stage canvas').all(),
        rings = await page.locator('.outline').all();
    check(canvases.length === pictures && rings.length === pictures, `an outline in each of ${pictures} pictures`);
    await page.evaluate(() => {
        const usual = Element.prototype.animate;
        window.held = [];
        Element.prototype.animate = function (...how) {
            const animation = usual.apply(this, how);
            animation.pause();
            window.held.push(animation);
            return animation;
        };
    });
    const box = await canvases[0].boundingBox();
    await page.mouse.move(box.x + 650, box.y + 300); // field 7
    const edges = [],
        drawn = [];
    for (const [i, ring] of rings.entries()) {
        const at = await ring.boundingBox(),
            from = await canvases[i].boundingBox();
        check(
            at.x === from.x + 600 && at.y === from.y + 200 && at.width === 200 && at.height === 200,
            `the outline lies around the field under the pointer, picture ${i + 1}`,
            JSON.stringify([at, from]),
        );
        edges.push({ x: at.x + 50, y: at.y, w: 100, h: 3 });
        drawn.push(await looker.part(page, edges[i]));
    }
    await look(page, `${shots}-outline`, ['choose a field'], pictures);
    await page.evaluate(() => window.held.forEach((animation) => animation.finish()));
    for (const [i, edge] of edges.entries()) {
        const after = await looker.part(page, edge);
        check(
            drawn[i].hi === 255 && drawn[i].lo === 0 && after.hi < 255 && after.lo > 0,
            `the outline is seen and goes away, picture ${i + 1}`,
            JSON.stringify([drawn[i], after]),
        );
    }
}

async function adjustByKeys(page, server, shots) {
    await state(page, 'asking');
    // a snake through the rows
    const order = [...Array(16).keys()].map((i) => ((i >> 2) % 2 ? 4 * (i >> 2) + 3 - (i % 4) : i));
    for (let n = 0; n < 16; n++) {
        if (n > 0)
            await page.keyboard.press(
                order[n] - order[n - 1] === 4 ? 'ArrowDown' : order[n] > order[n - 1] ? 'ArrowRight' : 'ArrowLeft',
            );
        for (let k = 0; k < 9; k++) await page.keyboard.press('-');
        await page.keyboard.press('+');
        await page.keyboard.press('+');
        if (n === 6) {
            await page.keyboard.down('Space');
            await look(page, `${shots}-reference`, ['the clean picture'], 2);
            await page.keyboard.up('Space');
        }
        await page.keyboard.press('Enter');
        await page.waitForFunction((m) => document.querySelectorAll('.map .done').length === m, n + 1);
    }
    await page.keyboard.press('Enter');
    await thanked(page, server, shots);
    const person = await stored(server, keyOf(page));
    check(
        person.trials.length === 16 && person.trials.every((t) => t.level === 64),
        'adjustment by keys alone: every field at the level chosen',
        JSON.stringify(person.trials),
    );
}

{
    const server = await study('adjustment', '--task', 'thresholds', '--views', path.join(root, 'ball'), '--repeats', '1');
    const page = await openPage(server.link, SMALL);
    await enter(page, 'small-adjustment', 'adjustment');
    await adjustByMouse(page, server, 'small-adjustment');
    check(true, 'adjustment to the end at 1280×800, by mouse');
    const profile = (await stored(server, keyOf(page))).profile;
    check(
        profile.answers.vision.startsWith('well') &&
            profile.screen.pixels_per_degree > 20 &&
            Math.abs(profile.screen.gamma - 2.2) < 0.1 &&
            profile.screen.device_pixel_ratio === 1,
        'answers and screen are stored',
        JSON.stringify(profile),
    );
    await page.context().close();
    const large = await openPage(server.link, LARGE);
    await enterByKeys(large, 'large-adjustment', 'adjustment');
    await state(large, 'asking');
    check((await large.locator('.stage canvas').count()) === 2, 'adjustment: the reference stands beside on a wide screen');
    await look(large, 'large-adjustment', ['Picture 1 of 1', 'Fields left to set: 16', 'choose a field'], 2);
    await outlined(large, 'large-adjustment', 2);
    await large.mouse.move(1900, 1000);
    for (const key of ['ArrowUp', 'ArrowLeft', 'ArrowLeft', 'ArrowLeft']) await large.keyboard.press(key);
    await adjustByKeys(large, server, 'large-adjustment');
    await large.context().close();
    const least = await openPage(server.link, LEAST);
    await enter(least, 'least', 'adjustment');
    await least.context().close();
    await server.stop();
}

// --- two intervals ---

async function answerTrials(page, n, key = () => '1') {
    for (let i = 0; i < n; i++) {
        await state(page, 'asking');
        await page.keyboard.press(key(i));
        await page.waitForFunction(() => document.body.dataset.state !== 'asking');
    }
}

// The first trial, step by step: the pictures while they are loaded, each interval while it is held, the question.
async function watch(page, shots) {
    let waiting = [];
    await page.route('**/stimuli/**', (route) => (waiting ? waiting.push(route) : route.continue()));
    await page.evaluate((ms) => {
        const usual = window.setTimeout;
        window.held = [];
        window.letGo = () => (window.setTimeout = usual);
        window.setTimeout = (f, delay, ...more) => (delay === ms ? window.held.push(f) : usual(f, delay, ...more));
    }, SHOW_MS);
    await page.getByRole('button', { name: 'Start' }).click();
    await page.getByText('Loading pictures').waitFor();
    await look(page, `${shots}-loading`, ['Loading pictures']);
    const held = waiting;
    waiting = null;
    for (const route of held) await route.continue();
    for (const interval of ['first', 'second']) {
        await page.waitForFunction(() => window.held.length === 1);
        await look(page, `${shots}-${interval}`, [interval], 1);
        await page.evaluate(() => window.held.shift()());
    }
    await page.evaluate(() => void window.letGo());
    await state(page, 'asking');
    await look(page, `${shots}-asking`, ['Which one was grainy?', '1  first', 'second  2']);
}

{
    const server = await study(
        '2ifc',
        '--task',
        'thresholds',
        '--method',
        '2ifc',
        '--views',
        path.join(root, 'small'),
        '--trials',
        '10',
        '--show',
        String(SHOW_MS),
        '--gap',
        '40',
        '--break-every',
        '12',
    );
    const page = await openPage(server.link, SMALL);
    await enter(page, 'small-2ifc', '2ifc');
    await watch(page, 'small-2ifc');
    await answerTrials(page, 4);
    await state(page, 'asking');
    const key = keyOf(page);
    check((await stored(server, key)).trials.length === 4, '2ifc: every answer is stored at once');
    await page.reload();
    await page.getByRole('button', { name: 'Start' }).click();
    await answerTrials(page, 1);
    await state(page, 'asking');
    check((await stored(server, key)).trials.length === 5, '2ifc: a reload goes on where it was');

    // a second tab goes on; the first one is told, and goes on after it
    const second = await page.context().newPage();
    await second.goto(page.url());
    await second.getByRole('button', { name: 'Start' }).click();
    await answerTrials(second, 1);
    await state(second, 'asking');
    await page.keyboard.press('2');
    await title(page, 'Open somewhere else');
    await look(page, 'small-conflict', ['Open somewhere else', 'Continue here']);
    check((await stored(server, key)).trials.length === 6, '2ifc: a second tab: nothing twice, nothing lost');
    await second.close();
    await page.getByRole('button', { name: 'Continue here' }).click();
    await page.getByRole('button', { name: 'Start' }).click();

    // the connection is lost while answering
    await state(page, 'asking');
    await page.context().setOffline(true);
    await page.keyboard.press('1');
    await page.getByText('The connection is lost').waitFor();
    await look(page, 'small-lost', ['The connection is lost', 'Nothing is gone']);
    check((await stored(server, key)).trials.length === 6, '2ifc: offline: the answer waits');
    await page.context().setOffline(false);
    await state(page, 'asking');
    check((await stored(server, key)).trials.length === 7, '2ifc: online again: it arrives');

    // the server is killed while answering
    await server.stop('SIGKILL');
    await page.keyboard.press('1');
    await page.getByText('The connection is lost').waitFor();
    await server.start();
    await state(page, 'asking');
    const after = await stored(server, key);
    check(
        after.trials.length === 8 && after.trials.every((t, i) => t.slot === i),
        '2ifc: killed and started again: all is there',
    );
    await answerTrials(page, 4);
    await title(page, 'Take a break');
    await look(page, 'small-break', ['Take a break', 'Done so far: 12 of 20', 'keep the address']);
    await page.keyboard.press('Enter');
    await answerTrials(page, 8, (i) => (i % 2 ? 'ArrowRight' : 'ArrowLeft'));
    await thanked(page, server, 'small-2ifc');
    const person = await stored(server, key);
    check(
        person.trials.length === 20 && person.slots.filter((s) => s.catch).length === 2,
        '2ifc to the end at 1280×800, one catch trial in ten',
    );
    check(
        person.trials.every((t) => !person.slots[t.slot].catch || t.level === 0),
        '2ifc: catch trials show heavy noise',
    );
    await page.context().close();

    const large = await openPage(server.link, LARGE);
    await enterByKeys(large, 'large-2ifc', '2ifc');
    await state(large, 'asking');
    await look(large, 'large-2ifc-asking', ['Which one was grainy?']);
    await answerTrials(large, 12, () => '2');
    await title(large, 'Take a break');
    await look(large, 'large-break', ['Take a break', 'Done so far: 12 of 20']);
    await large.keyboard.press('Enter');
    await answerTrials(large, 8, () => '2');
    await thanked(large, server, 'large-2ifc');
    check((await stored(server, keyOf(large))).trials.length === 20, '2ifc to the end at 1960×1080, by keys alone');
    await large.context().close();
    await server.stop();
}

// --- validation ---

async function judge(page, beside, key) {
    await state(page, 'asking');
    if (!beside) {
        await page.keyboard.press('ArrowRight');
        await page.waitForTimeout(80);
    }
    await page.keyboard.press(key);
    await state(page, 'rating');
    await page.keyboard.press(key === 's' ? '5' : '3');
    await page.waitForFunction(() => document.body.dataset.state !== 'rating');
}

for (const [name, viewport, beside] of [
    ['small', SMALL, false],
    ['large', LARGE, true],
]) {
    const server = await study(
        `validation-${name}`,
        '--task',
        'validation',
        '--views',
        path.join(root, 'room'),
        path.join(root, 'hall'),
        '--gap',
        '40',
        '--repeats',
        '2',
    );
    const page = await openPage(server.link, viewport);
    const shots = `${name}-validation`;
    await enterByKeys(page, shots, 'validation');
    await state(page, 'asking');
    await page.waitForFunction(() => document.querySelector('canvas').getContext('2d').getImageData(9, 9, 1, 1).data[3] > 0);
    await look(page, shots, ['Pair 1 of', 'Do A and B look the same?', 'S  same', 'D  different'], beside ? 2 : 1);
    if (!beside) {
        await page.keyboard.press('s');
        await page.getByText('Look at A and at B first').waitFor();
        await look(page, `${shots}-both`, ['Look at A and at B first'], 1);
    }
    const total = (await stored(server, keyOf(page))).slots.length;
    await judge(page, beside, 's');
    await state(page, 'asking');
    await page.reload();
    await page.getByRole('button', { name: 'Start' }).click();
    for (let i = 1; i < total; i++) {
        if (i === 2) {
            await state(page, 'asking');
            if (!beside) {
                await page.keyboard.press('ArrowRight');
                await page.waitForTimeout(80);
            }
            await page.keyboard.press('d');
            await state(page, 'rating');
            await look(page, `${shots}-rating`, ['And the difference?', '1  very disturbing', '5  I see none'], beside ? 2 : 1);
            await page.getByRole('button', { name: 'slightly' }).click();
            await page.waitForFunction(() => document.body.dataset.state !== 'rating');
        } else {
            await judge(page, beside, i % 3 ? 's' : 'd');
        }
    }
    await thanked(page, server, shots);
    const person = await stored(server, keyOf(page));
    check(
        person.trials.length === total &&
            person.trials[0].answer === 1 &&
            person.trials[2].answer === 0 &&
            person.trials[2].rating === 3,
        `validation to the end at ${viewport.width}×${viewport.height}`,
    );
    await page.context().close();
    await server.stop();
}

// --- what is refused ---

{
    const server = await study('refuse', '--task', 'validation', '--views', path.join(root, 'room'));
    for (const [name, viewport, options, words] of [
        ['ratio', SMALL, { deviceScaleFactor: 1.25 }, 'scales pages by 1.25'],
        ['small', { width: 900, height: 700 }, {}, 'too small'],
    ]) {
        const page = await openPage(server.link, viewport, options);
        check(
            await page
                .getByText(words)
                .waitFor()
                .then(
                    () => true,
                    () => false,
                ),
            `refused with a text: ${name}`,
        );
        await look(page, `refuse-${name}`, ['One moment', words]);
        if (name === 'small') {
            await page.setViewportSize(SMALL);
            await page.locator('#notice').waitFor({ state: 'hidden' });
            check(
                await page.getByRole('heading', { name: 'A study on noise' }).isVisible(),
                'a larger window goes on by itself',
            );
        }
        await page.context().close();
    }
    const retina = await openPage(server.link, SMALL, { deviceScaleFactor: 2 });
    await title(retina, 'A study on noise');
    check(await retina.locator('#notice').isHidden(), 'two device pixels per pixel are let in');
    const zoomed = await retina.context().newPage();
    await zoomed.addInitScript(() => Object.defineProperty(window, 'outerWidth', { get: () => window.innerWidth * 1.5 }));
    await zoomed.goto(server.link);
    check(
        await zoomed
            .getByText('zoomed to about 150 %')
            .waitFor()
            .then(
                () => true,
                () => false,
            ),
        'refused with a text: zoom',
    );
    await look(zoomed, 'refuse-zoom', ['One moment', 'zoomed to about 150 %']);
    const stranger = await retina.context().newPage(); // the zoomed one would say again that it is zoomed
    await stranger.goto(`${server.link}?p=${'0'.repeat(32)}`);
    check(
        await stranger
            .getByText('Nobody has this link')
            .waitFor()
            .then(
                () => true,
                () => false,
            ),
        'an unknown link is told so',
    );
    await look(stranger, 'unknown', ['Nobody has this link', ASKED_BY, CONTACT]);
    const broken = await openPage(server.link, SMALL);
    await broken.route('**/api/people', (route) => route.fulfill({ status: 400, json: { error: 'a reason' } }));
    await title(broken, 'A study on noise');
    await broken.getByRole('checkbox').check();
    await broken.getByRole('button', { name: 'I agree' }).click();
    await broken.getByText('Something went wrong').waitFor();
    await look(broken, 'failed', ['Something went wrong: a reason', 'reload the page']);
    check(errors.splice(0).join().includes('a reason'), 'what failed is in the console too');
    await server.stop();
}

check(outside.length === 0, 'nothing was asked from outside', outside.join('\n'));
check(errors.length === 0, 'no errors in the browser', errors.join('\n'));
await browser.close();
finish();
