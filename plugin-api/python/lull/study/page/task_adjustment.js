// Thresholds by adjustment: the whole picture, each block made cleaner or grainier until it looks the same as the reference.
import { element, paused } from './dom.js';
import { blockUrl, canvas } from './stimuli.js';
import { say, text } from './texts.js';

const PANEL = 300,
    GAP = 24; // CSS pixels
const WHEEL_STEP = 60; // of deltaY, so that a touch pad does not run away
// The outline of the chosen field: long enough to find it, then gone, since it would disturb the judgement.
const FADE = [[{ opacity: 1 }, { opacity: 1, offset: 0.4 }, { opacity: 0 }], { duration: 1500 }];

class Screen {
    // slots: [{number, block, start}], all of one view; display is filled.
    constructor(session, display, slots, screens) {
        this.session = session;
        this.slots = slots;
        this.viewIndex = slots[0].view;
        this.view = session.study.views[this.viewIndex];
        this.blocks = slots.map((s) => this.view.blocks[s.block]);
        this.level = slots.map((s, i) => {
            const set = this.settings(i);
            return set.length ? this.blocks[i].levels.indexOf(set.at(-1).level) : s.start;
        });
        this.here = 0;
        this.wheel = 0;
        this.storing = Promise.resolve();
        this.since = performance.now();
        this.build(display, screens);
    }

    settings(i) {
        return this.session.person.trials.filter((t) => t.slot === this.slots[i].number);
    }
    get left() {
        return this.slots.filter((s, i) => this.settings(i).length === 0).length;
    }

    build(display, screens) {
        const { width, height } = this.view;
        this.picture = canvas(width, height);
        if (window.innerWidth >= 2 * width + GAP + PANEL) this.beside = canvas(width, height);
        const pictures = [this.picture, this.beside].filter(Boolean);
        this.outlines = pictures.map(() => element('div.outline'));
        this.stage = element(
            'div.stage',
            { tabIndex: 0 },
            ...pictures.map((p, i) => element('div.picture', {}, p, this.outlines[i])),
        );
        const columns = [...new Set(this.blocks.map((b) => b.x0))].length;
        this.map = element('div.map', {}, ...this.blocks.map(() => element('span')));
        this.map.style.gridTemplateColumns = `repeat(${columns}, 26px)`;
        this.line = element('p');
        this.next = element('button', { disabled: true }, say('adjustment.next'));
        this.note = element('p.hint', { hidden: true }, say('adjustment.reference'));
        const keys = text('adjustment.keys').flatMap(([key, what]) => [element('dt', {}, key), element('dd', {}, what)]);
        display.replaceChildren(
            element(
                'div.work',
                {},
                this.stage,
                element(
                    'div.panel',
                    {},
                    element('h1', {}, say('adjustment.panel', { screen: this.slots[0].screen + 1, screens })),
                    this.map,
                    this.line,
                    element('dl', {}, ...keys),
                    this.next,
                    this.note,
                ),
            ),
        );
        this.mark();
    }

    async start() {
        const { stimuli } = this.session;
        this.references = await Promise.all(
            this.blocks.map((b) => stimuli.bitmap(blockUrl(this.viewIndex, b, 'reference'))),
        );
        if (this.beside)
            this.references.forEach((r, i) =>
                this.beside.getContext('2d').drawImage(r, this.blocks[i].x0, this.blocks[i].y0),
            );
        await Promise.all(this.blocks.map((b, i) => this.paint(i)));
        this.stage.focus();
        this.outline();
        this.since = performance.now();
    }

    // Shows for a moment where the chosen block lies, in the picture and in the one beside.
    outline() {
        const b = this.blocks[this.here];
        for (const e of this.outlines) {
            Object.assign(e.style, {
                left: `${b.x0}px`,
                top: `${b.y0}px`,
                width: `${b.x1 - b.x0}px`,
                height: `${b.y1 - b.y0}px`,
            });
            for (const old of e.getAnimations()) old.cancel();
            e.animate(...FADE);
        }
    }

    async paint(i, reference = false) {
        const b = this.blocks[i],
            level = this.level[i];
        const bitmap = reference
            ? this.references[i]
            : await this.session.stimuli.bitmap(blockUrl(this.viewIndex, b, b.levels[level]));
        // a later turn of the wheel was painted already
        if (!reference && (level !== this.level[i] || this.showingReference)) return;
        this.picture.getContext('2d').drawImage(bitmap, b.x0, b.y0);
    }

    showReference(on) {
        if (on === Boolean(this.showingReference)) return;
        this.showingReference = on;
        this.note.hidden = !on;
        this.blocks.forEach((b, i) => this.paint(i, on));
    }

    mark() {
        [...this.map.children].forEach((span, i) => {
            span.className = [i === this.here && 'here', this.settings(i).length > 0 && 'done'].filter(Boolean).join(' ');
            span.textContent = this.settings(i).length > 0 ? '✓' : '';
        });
        this.line.textContent = say('adjustment.missing', { left: this.left });
        this.next.disabled = this.left > 0;
    }

    select(i, scroll) {
        if (i === this.here) return;
        this.here = i;
        this.since = performance.now();
        this.mark();
        this.outline();
        const b = this.blocks[i];
        if (scroll)
            this.stage.scrollTo({
                top: b.y0 - (this.stage.clientHeight - (b.y1 - b.y0)) / 2,
                left: b.x0 - (this.stage.clientWidth - (b.x1 - b.x0)) / 2,
            });
    }

    // The nearest block in a direction, by centres.
    move(dx, dy) {
        const centre = (b) => [(b.x0 + b.x1) / 2, (b.y0 + b.y1) / 2];
        const [x, y] = centre(this.blocks[this.here]);
        let best = -1,
            least = Infinity;
        this.blocks.forEach((b, i) => {
            const [bx, by] = centre(b);
            const along = (bx - x) * dx + (by - y) * dy,
                across = Math.abs((bx - x) * dy) + Math.abs((by - y) * dx);
            if (along > 0 && along + 2 * across < least) [best, least] = [i, along + 2 * across];
        });
        if (best >= 0) this.select(best, true);
    }

    change(steps) {
        const last = this.blocks[this.here].levels.length - 1;
        this.level[this.here] = Math.min(last, Math.max(0, this.level[this.here] + steps));
        this.paint(this.here);
    }

    // Settings are stored one after the other; the mark appears when the server has it.
    set() {
        const i = this.here,
            level = this.blocks[i].levels[this.level[i]],
            ms = Math.round(performance.now() - this.since);
        this.storing = this.storing.then(async () => {
            const done = this.settings(i);
            if (done.length && done.at(-1).level === level) return;
            await this.session.store({ slot: this.slots[i].number, revision: done.length, level, answer: 0, rating: 0, ms });
            this.mark();
            if (this.left === 0) this.next.focus();
        });
        this.storing.catch(this.reject);
    }

    key(event) {
        if (paused() || (event.target === this.next && event.key === 'Enter')) return;
        const { moves, levels } = KEYS;
        if (event.key in moves) this.move(...moves[event.key]);
        else if (event.key in levels) this.change(levels[event.key]);
        else if (event.key === ' ') this.showReference(true);
        else if (event.key === 'Enter' && !event.repeat) this.set();
        else return;
        event.preventDefault();
    }

    at(event) {
        const box = this.picture.getBoundingClientRect(),
            x = event.clientX - box.left,
            y = event.clientY - box.top;
        return this.blocks.findIndex((b) => x >= b.x0 && x < b.x1 && y >= b.y0 && y < b.y1);
    }

    // Resolves when all blocks are set and the person goes on.
    run() {
        return new Promise((resolve, reject) => {
            this.reject = reject;
            const off = new AbortController(),
                listen = (target, type, f) => target.addEventListener(type, f, { signal: off.signal, passive: false });
            listen(document, 'keydown', (event) => this.key(event));
            listen(document, 'keyup', (event) => event.key === ' ' && this.showReference(false));
            listen(window, 'blur', () => this.showReference(false));
            listen(this.picture, 'pointermove', (event) => {
                const i = this.at(event);
                if (i >= 0) this.select(i, false);
            });
            listen(this.picture, 'click', (event) => {
                const i = this.at(event);
                if (i >= 0) {
                    this.select(i, false);
                    this.set();
                }
            });
            listen(this.picture, 'wheel', (event) => {
                event.preventDefault();
                this.wheel += event.deltaY;
                const steps = Math.trunc(this.wheel / WHEEL_STEP);
                this.wheel -= steps * WHEEL_STEP;
                if (steps) this.change(-Math.sign(steps));
            });
            this.next.onclick = () => {
                off.abort();
                this.storing.then(resolve, reject);
            };
        });
    }
}

const KEYS = {
    moves: { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] },
    levels: { '+': 1, '=': 1, PageUp: 1, '-': -1, '−': -1, PageDown: -1 },
};

export function adjustment(session) {
    return async function trial(display) {
        const numbered = session.person.slots.map((slot, number) => ({ ...slot, number }));
        const done = new Set(session.person.trials.map((t) => t.slot));
        const open = numbered.find((slot) => !done.has(slot.number)).screen;
        const slots = numbered.filter((slot) => slot.screen === open);
        const view = session.study.views[slots[0].view];
        await session.stimuli.load(
            display,
            view.blocks.flatMap((b) => ['reference', ...b.levels].map((l) => blockUrl(slots[0].view, b, l))),
        );
        const screen = new Screen(session, display, slots, numbered.at(-1).screen + 1);
        const finished = screen.run();
        await screen.start();
        document.body.dataset.state = 'asking';
        await finished;
        document.body.dataset.state = 'storing';
    };
}
