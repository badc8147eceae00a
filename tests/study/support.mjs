// What the tests of `lull-study` share: TAP, pictures to show, a server to talk to, and its kill and restart.
import { execFileSync, spawn } from 'node:child_process';
import fs from 'node:fs';
import http from 'node:http';
import path from 'node:path';
import zlib from 'node:zlib';

let count = 0,
    failed = 0;

export function check(ok, name, detail = '') {
    count++;
    if (!ok) failed++;
    console.log(
        `${ok ? 'ok' : 'not ok'} ${count} - ${name}${!ok && detail !== '' ? `\n# ${String(detail).replaceAll('\n', '\n# ')}` : ''}`,
    );
}

export function finish() {
    console.log(`1..${count}`);
    process.exitCode = failed ? 1 : 0;
}

// Uniform in [0, 1) from a seed (mulberry32); normal by Box and Muller.
export function random(seed) {
    let a = seed >>> 0;
    const next = () => {
        a = (a + 0x6d2b79f5) | 0;
        let t = Math.imul(a ^ (a >>> 15), 1 | a);
        t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
        return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
    };
    next.normal = () => Math.sqrt(-2 * Math.log(1 - next())) * Math.cos(2 * Math.PI * next());
    return next;
}

// --- pictures ---

function chunk(type, data) {
    const body = Buffer.concat([Buffer.from(type, 'latin1'), data]),
        out = Buffer.alloc(body.length + 8);
    out.writeUInt32BE(data.length, 0);
    body.copy(out, 4);
    out.writeUInt32BE(crc(body), body.length + 4);
    return out;
}

const table = Array.from({ length: 256 }, (_, n) => {
    for (let k = 0; k < 8; k++) n = n & 1 ? 0xedb88320 ^ (n >>> 1) : n >>> 1;
    return n >>> 0;
});
const crc = (bytes) => (bytes.reduce((c, b) => table[(c ^ b) & 255] ^ (c >>> 8), 0xffffffff) ^ 0xffffffff) >>> 0;

// A PNG of rgb(x, y) → [r, g, b].
export function writePng(file, width, height, rgb) {
    const rows = Buffer.alloc(height * (3 * width + 1));
    for (let y = 0; y < height; y++)
        for (let x = 0; x < width; x++) {
            const at = y * (3 * width + 1) + 1 + 3 * x,
                colour = rgb(x, y);
            for (let c = 0; c < 3; c++) rows[at + c] = Math.max(0, Math.min(255, Math.round(colour[c])));
        }
    const head = Buffer.alloc(13);
    head.writeUInt32BE(width, 0);
    head.writeUInt32BE(height, 4);
    head.set([8, 2, 0, 0, 0], 8);
    fs.writeFileSync(
        file,
        Buffer.concat([
            Buffer.from([137, 80, 78, 71, 13, 10, 26, 10]),
            chunk('IHDR', head),
            chunk('IDAT', zlib.deflateSync(rows, { level: 1 })),
            chunk('IEND', Buffer.alloc(0)),
        ]),
    );
}

// A ball on a floor, without noise.
export function scene(width, height) {
    return (x, y) => {
        const u = x / width,
            v = y / height,
            d = Math.hypot(u - 0.5, v - 0.55);
        if (d < 0.27) {
            const light = Math.max(0.12, 1 - (1.6 * Math.hypot(u - 0.42, v - 0.43)) / 0.5);
            return [210 * light, 120 * light, 70 * light];
        }
        if (v > 0.6) return [95, 100, 90].map((c) => c + (((x >> 5) + (y >> 5)) & 1 ? 18 : 0) - 60 * Math.max(0, 0.34 - d));
        return [120 + 60 * v, 140 + 50 * v, 165 + 40 * v];
    };
}

export function noisy(clean, sigma, seed) {
    const next = random(seed);
    return (x, y) => clean(x, y).map((c) => c + sigma * next.normal());
}

// A folder of levels for thresholds: reference.png and one picture per level, noise falling with the root of the samples.
export function makeLevels(folder, width, height, levels) {
    fs.mkdirSync(folder, { recursive: true });
    const clean = scene(width, height);
    writePng(path.join(folder, 'reference.png'), width, height, clean);
    for (const n of levels)
        writePng(path.join(folder, `level-${n}.png`), width, height, noisy(clean, 160 / Math.sqrt(n), n));
}

// A folder of a clip: for each level and the reference a folder of frames, in which the ball moves.
export function makeClip(folder, width, height, levels, frames) {
    for (const level of ['reference', ...levels]) {
        fs.mkdirSync(path.join(folder, String(level)), { recursive: true });
        for (let k = 1; k <= frames; k++) {
            const still = scene(width, height),
                clean = (x, y) => still(x + 6 * (k - frames / 2), y);
            writePng(
                path.join(folder, String(level), `${String(k).padStart(4, '0')}.png`),
                width,
                height,
                level === 'reference' ? clean : noisy(clean, 160 / Math.sqrt(level), 100 * level + k),
            );
        }
    }
}

export function makeConditions(folder, width, height, sigmas) {
    fs.mkdirSync(folder, { recursive: true });
    const clean = scene(width, height);
    writePng(path.join(folder, 'reference.png'), width, height, clean);
    for (const [name, sigma] of Object.entries(sigmas))
        writePng(path.join(folder, `${name}.png`), width, height, noisy(clean, sigma, 7));
}

// --- the program ---

// init: who asks is said for the caller
export const ASKED_BY = 'Ada Example, Test Lab',
    CONTACT = 'room 7, or tests@lab.example';
export const lullStudy = (verb, ...args) =>
    execFileSync(
        process.env.LULL_STUDY,
        [verb, ...args, ...(verb === 'init' ? ['--asked-by', ASKED_BY, '--contact', CONTACT] : [])],
        { encoding: 'utf8' },
    );

export class Server {
    constructor(dir, listen = '127.0.0.1:0') {
        this.dir = dir;
        this.listen = listen;
        this.log = '';
    }
    async start() {
        this.child = spawn(process.env.LULL_STUDY, ['serve', this.dir, '--listen', this.listen], {
            stdio: ['ignore', 'pipe', 'pipe'],
        });
        process.once('exit', () => this.child.kill('SIGKILL')); // also when a test ends in the middle
        this.child.stderr.on('data', (d) => {
            this.log += d;
        });
        this.exited = new Promise((resolve) => this.child.on('exit', (code, signal) => resolve(signal ?? code)));
        this.link = await new Promise((resolve, reject) => {
            this.child.stdout.once('data', (d) => resolve(String(d).trim()));
            this.exited.then((code) => reject(new Error(`serve ended with ${code}: ${this.log}`)));
        });
        this.port = Number(new URL(this.link).port);
        this.listen = `127.0.0.1:${this.port}`; // the same again after a kill
        return this;
    }
    async stop(signal = 'SIGTERM') {
        this.child.kill(signal);
        return this.exited;
    }
}

// --- HTTP ---

// One kept connection per client, as a browser has. Resolves to {status, body, ms}.
export class Client {
    agent = new http.Agent({ keepAlive: true, maxSockets: 1 });
    constructor(link) {
        this.base = new URL(link);
    }
    request(method, address, body) {
        const text = body === undefined ? undefined : JSON.stringify(body);
        const headers =
            text === undefined ? {} : { 'Content-Type': 'application/json', 'Content-Length': Buffer.byteLength(text) };
        const from = process.hrtime.bigint();
        return new Promise((resolve, reject) => {
            const q = http.request(
                {
                    host: this.base.hostname,
                    port: this.base.port,
                    path: this.base.pathname + address,
                    method,
                    headers,
                    agent: this.agent,
                },
                (r) => {
                    const parts = [];
                    r.on('data', (d) => parts.push(d));
                    r.on('end', () => {
                        const data = Buffer.concat(parts).toString();
                        resolve({
                            status: r.statusCode,
                            body: data ? JSON.parse(data) : null,
                            ms: Number(process.hrtime.bigint() - from) / 1e6,
                        });
                    });
                },
            );
            q.on('error', reject);
            q.end(text);
        });
    }
    get(address) {
        return this.request('GET', address);
    }
    post(address, body) {
        return this.request('POST', address, body);
    }
    close() {
        this.agent.destroy();
    }
}
