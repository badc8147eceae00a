// Load: 50 simulated participants at once. Nothing is lost; the times of answers are told, and `scripts/lab bench --only study` judges them.
// usage: LULL_STUDY=… node load.mjs FOLDER
import fs from 'node:fs';
import path from 'node:path';
import { Client, Server, check, finish, lullStudy, makeLevels, random } from './support.mjs';

const root = process.argv[2];
const PARTICIPANTS = 50;

fs.rmSync(root, { recursive: true, force: true });
fs.mkdirSync(root, { recursive: true });
makeLevels(path.join(root, 'view'), 400, 200, [16, 64, 256, 1024]);
lullStudy(
    'init',
    path.join(root, 'study'),
    '--task',
    'thresholds',
    '--method',
    '2ifc',
    '--trials',
    '10',
    '--views',
    path.join(root, 'view'),
);
const server = await new Server(path.join(root, 'study')).start();
const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const times = [],
    sent = [];

async function participate(seed) {
    const next = random(seed),
        client = new Client(server.link);
    await sleep(1500 * next());
    const { body } = await client.post('api/people', { consent: true });
    const me = (await client.get(`api/people/${body.key}`)).body;
    for (const [slot, s] of me.slots.entries()) {
        await sleep(500 + 1000 * next()); // three times as fast as two intervals and an answer take
        const trial = {
            slot,
            revision: 0,
            level: s.catch ? 0 : [16, 64, 256, 1024][Math.floor(4 * next())],
            answer: 1 + Math.floor(2 * next()),
            rating: 0,
            ms: 1,
        };
        const { status, ms } = await client.post(`api/people/${body.key}/trials`, trial);
        if (status !== 200) throw new Error(`refused: ${status}`);
        times.push(ms);
        sent.push(`${body.key} ${slot} ${trial.level} ${trial.answer}`);
    }
    client.close();
    return body.key;
}

const from = Date.now();
const keys = await Promise.all(Array.from({ length: PARTICIPANTS }, (_, i) => participate(i + 1)));
const seconds = (Date.now() - from) / 1000;
await server.stop('SIGKILL');
await server.start();
const client = new Client(server.link),
    kept = [];
for (const key of keys)
    for (const t of (await client.get(`api/people/${key}`)).body.trials)
        kept.push(`${key} ${t.slot} ${t.level} ${t.answer}`);
client.close();
await server.stop();

times.sort((a, b) => a - b);
const at = (q) => times[Math.min(times.length - 1, Math.floor(q * times.length))].toFixed(1);
console.log(
    `# ${PARTICIPANTS} at once, ${times.length} trials in ${seconds.toFixed(1)} s: ` +
        `median ${at(0.5)} ms, 99th percentile ${at(0.99)} ms, worst ${at(1)} ms`,
);
check(
    JSON.stringify(kept.sort()) === JSON.stringify(sent.sort()),
    'every trial that was acknowledged is there, even after a kill',
);
finish();
