// Simulated participants, never called people: known psychometric curves go through the page's own QUEST+ and the server's
// HTTP, and `lull-study report` must give their thresholds back: bias below 0.1 octave, 95 ± 2 % of the intervals right. Seeded.
// usage: LULL_STUDY=… node simulate.mjs FOLDER [RUNS]
import fs from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import { Client, Server, check, finish, lullStudy, random, writePng } from './support.mjs';

console.log = (
    (log) =>
    (...words) => {
        if (!String(words[0]).startsWith('jsQuestPlus')) log(...words);
    }
)(console.log);
const { Quest } = await import(pathToFileURL(path.join(process.env.PAGE, 'quest.js')));

const root = process.argv[2];
const RUNS = Number(process.argv[3] ?? 500);
const LEVELS = Array.from({ length: 37 }, (_, i) => Math.round(20 * 2 ** (i / 4))); // 20 … 10240

fs.rmSync(root, { recursive: true, force: true });
fs.mkdirSync(root, { recursive: true });

function makeView(name, blocks) {
    const folder = path.join(root, name);
    fs.mkdirSync(folder);
    for (const what of ['reference', ...LEVELS])
        writePng(path.join(folder, `${what}.png`), 8 * blocks, 8, () => [128, 128, 128]);
    return folder;
}

async function study(name, blocks, ...args) {
    const dir = path.join(root, name);
    lullStudy('init', dir, '--task', 'thresholds', '--views', makeView(`view-${name}`, blocks), '--block', '8', ...args);
    return new Server(dir).start();
}

async function enter(client) {
    const { body } = await client.post('api/people', { consent: true });
    const me = (await client.get(`api/people/${body.key}`)).body;
    return { ...body, slots: me.slots };
}

// Phi, by the complementary error function of Numerical Recipes (relative error below 1.2e-7): not the code under test.
function phi(z) {
    const x = Math.abs(z) / Math.SQRT2,
        t = 1 / (1 + 0.5 * x);
    const e =
        t *
        Math.exp(
            -x * x -
                1.26551223 +
                t *
                    (1.00002368 +
                        t *
                            (0.37409196 +
                                t *
                                    (0.09678418 +
                                        t *
                                            (-0.18628806 +
                                                t *
                                                    (0.27886807 +
                                                        t *
                                                            (-1.13520398 +
                                                                t * (1.48851587 + t * (-0.82215223 + t * 0.17087277)))))))),
        );
    return z > 0 ? 1 - e / 2 : e / 2;
}
function quantile(p) {
    let lo = -9,
        hi = 9;
    for (let i = 0; i < 60; i++) phi((lo + hi) / 2) < p ? (lo = (lo + hi) / 2) : (hi = (lo + hi) / 2);
    return (lo + hi) / 2;
}

// Whether a participant is right: a lapse is a guess; otherwise the noise is felt as d + normal noise, and a criterion that is
// off centre favours one interval.
function isCorrect({ spread, lapse, criterion }, t, level, noiseFirst, next) {
    if (next() < lapse) return next() < 0.5;
    const d = quantile(0.5 + 0.5 * phi((t - Math.log2(level)) / spread));
    return d + (noiseFirst ? criterion : -criterion) + next.normal() > 0;
}

const CURVES = {
    careful: { spread: 0.5, lapse: 0, criterion: 0 },
    lapsing: { spread: 0.5, lapse: 0.08, criterion: 0 },
    'criterion shifted': { spread: 0.5, lapse: 0, criterion: 0.6 },
    sharp: { spread: 0.3, lapse: 0.01, criterion: 0 },
    'broad, lapsing, shifted': { spread: 0.8, lapse: 0.03, criterion: -0.3 },
};

function readCsv(file) {
    const [head, ...lines] = fs
        .readFileSync(file, 'utf8')
        .trim()
        .split('\n')
        .map((line) => line.split(';'));
    return lines.map((line) => Object.fromEntries(head.map((name, i) => [name, line[i]])));
}

// Estimates of a study against the truth: {id: {curve, t: [octaves by block]}}.
function judge(dir, truth, what) {
    fs.writeFileSync(path.join(dir, 'truth.json'), JSON.stringify(truth));
    const out = lullStudy('report', dir, '--no-pictures');
    const errors = [],
        groups = {};
    for (const row of readCsv(path.join(dir, 'report', 'estimates.csv'))) {
        const { curve, t } = truth[row.person];
        const log = (x) => Math.log2(Number(x)),
            real = t[Number(row.block)];
        const e = {
            error: log(row.threshold) - real,
            covered: log(row.low) <= real && real <= log(row.high),
            width: log(row.high) - log(row.low),
        };
        errors.push(e);
        (groups[curve] ??= []).push(e);
    }
    const mean = (list, f) => list.reduce((s, e) => s + f(e), 0) / list.length;
    for (const [name, list] of [...Object.entries(groups), ['all', errors]])
        console.log(
            `# ${what}, ${name}: ${list.length} runs, bias ${mean(list, (e) => e.error).toFixed(3)} octaves, rms error ` +
                `${Math.sqrt(mean(list, (e) => e.error ** 2)).toFixed(3)}, covered ${(100 * mean(list, (e) => Number(e.covered))).toFixed(1)} %, mean width ` +
                `${mean(list, (e) => e.width).toFixed(2)}`,
        );
    return { n: errors.length, bias: mean(errors, (e) => e.error), covered: mean(errors, (e) => Number(e.covered)), out };
}

// --- two intervals ---
{
    const BLOCKS = 10;
    const server = await study('2ifc', BLOCKS, '--method', '2ifc', '--trials', '30', '--break-every', '0');
    const client = new Client(server.link),
        next = random(20240501),
        truth = {},
        names = Object.keys(CURVES),
        from = Date.now();
    for (let i = 0; i < Math.ceil(RUNS / BLOCKS); i++) {
        const me = await enter(client),
            curve = names[i % names.length],
            t = Array.from({ length: BLOCKS }, () => 5 + 8 * next());
        const quests = t.map(() => new Quest(LEVELS));
        truth[me.id] = { curve, t };
        for (const [slot, s] of me.slots.entries()) {
            const level = s.catch ? 0 : quests[s.block].next();
            const correct = isCorrect(CURVES[curve], t[s.block], level, s.side === 0, next);
            if (!s.catch) quests[s.block].update(level, correct);
            const { status } = await client.post(`api/people/${me.key}/trials`, {
                slot,
                revision: 0,
                level,
                answer: (s.side === 0) === correct ? 1 : 2,
                rating: 0,
                ms: 800,
            });
            if (status !== 200) throw new Error(`trial refused: ${status}`);
        }
    }
    const seconds = (Date.now() - from) / 1000;
    client.close();
    await server.stop();
    const { n, bias, covered } = judge(path.join(root, '2ifc'), truth, 'two intervals');
    console.log(`# ${((1000 * seconds) / n).toFixed(0)} ms per run of 30 trials`);
    check(n >= RUNS, `two intervals: ${n} runs`);
    check(Math.abs(bias) < 0.1, 'two intervals: unbiased within 0.1 octave', bias);
    check(covered >= 0.93 && covered <= 0.97, 'two intervals: 95 ± 2 % of the intervals hold the threshold', covered);
}

// --- adjustment: the criterion is part of a person's threshold, the scatter of settings is not ---
{
    const BLOCKS = 16;
    const server = await study('adjustment', BLOCKS, '--repeats', '2');
    const client = new Client(server.link),
        next = random(7),
        truth = {};
    for (let i = 0; i < Math.ceil(RUNS / BLOCKS); i++) {
        const me = await enter(client),
            scatter = [0.2, 0.35, 0.5][i % 3],
            criterion = 0.5 * next.normal();
        const t = Array.from({ length: BLOCKS }, () => 7 + 4 * next() + criterion);
        truth[me.id] = { curve: `scatter ${scatter}`, t };
        for (const [slot, s] of me.slots.entries()) {
            const wanted = t[s.block] + scatter * next.normal();
            const level = LEVELS.reduce((best, l) =>
                Math.abs(Math.log2(l) - wanted) < Math.abs(Math.log2(best) - wanted) ? l : best,
            );
            await client.post(`api/people/${me.key}/trials`, { slot, revision: 0, level, answer: 0, rating: 0, ms: 4000 });
        }
    }
    client.close();
    await server.stop();
    const { n, bias, covered } = judge(path.join(root, 'adjustment'), truth, 'adjustment');
    check(n >= RUNS && Math.abs(bias) < 0.1, 'adjustment: unbiased within 0.1 octave', bias);
    check(covered >= 0.93 && covered <= 0.97, 'adjustment: 95 ± 2 % of the intervals hold the threshold', covered);
}

// --- who does not do the task ---
{
    const BLOCKS = 16,
        BAD = 10;
    const server = await study('catch', BLOCKS, '--method', '2ifc', '--trials', '30');
    const client = new Client(server.link),
        next = random(99),
        bad = new Set(),
        good = new Set();
    for (let i = 0; i < 2 * BAD; i++) {
        const me = await enter(client),
            guesses = i < BAD;
        (guesses ? bad : good).add(me.id);
        for (const [slot, s] of me.slots.entries()) {
            const level = s.catch ? 0 : LEVELS[12],
                correct = guesses ? next() < 0.5 : isCorrect(CURVES.lapsing, 9, level, s.side === 0, next);
            await client.post(`api/people/${me.key}/trials`, {
                slot,
                revision: 0,
                level,
                answer: (s.side === 0) === correct ? 1 : 2,
                rating: 0,
                ms: 500,
            });
        }
    }
    client.close();
    await server.stop();
    lullStudy('report', path.join(root, 'catch'), '--no-pictures');
    const rows = readCsv(path.join(root, 'catch', 'report', 'people.csv'));
    const found = rows.filter((r) => bad.has(r.person) && r.excluded).length,
        wronged = rows.filter((r) => good.has(r.person) && r.excluded).length;
    check(found === BAD, `catch trials find who guesses: ${found} of ${BAD}`);
    check(wronged === 0, `and nobody who lapses in 8 %: ${wronged} of ${BAD}`);
}

finish();
