// A reconstructed picture against its reference: same or different, and how disturbing the difference is.
import { choice, element, wait } from './dom.js';
import { canvas, pictureUrl } from './stimuli.js';
import { say, text } from './texts.js';

const PANEL = 300,
    GAP = 24; // CSS pixels
const AHEAD = 3; // pairs that are fetched while one is judged

export function validation(session) {
    function urls(slot) {
        const judged =
            slot.catch === 1 ? 'heavy' : slot.catch === 2 ? 'reference' : session.study.conditions[slot.condition];
        return [pictureUrl(slot.view, judged), pictureUrl(slot.view, 'reference')];
    }

    // Both pictures side by side where they fit, else in the same place, with a blank between, one at a time.
    function stage(bitmaps, view, beside) {
        const box = element('div.stage', { tabIndex: 0 });
        if (beside) {
            for (const bitmap of bitmaps) {
                const c = canvas(view.width, view.height);
                c.getContext('2d').drawImage(bitmap, 0, 0);
                box.append(c);
            }
            return { box, show: () => {}, seen: () => true };
        }
        const c = canvas(view.width, view.height),
            context = c.getContext('2d'),
            seen = new Set();
        let shown = -1;
        const show = async (which) => {
            if (which === shown) return;
            shown = which;
            context.clearRect(0, 0, view.width, view.height);
            await wait(session.study.gap_ms);
            if (shown === which) context.drawImage(bitmaps[which], 0, 0);
            seen.add(which);
        };
        box.append(c);
        return { box, show, seen: () => seen.size === 2 };
    }

    const keyList = (pairs) =>
        element('dl', {}, ...pairs.flatMap(([key, what]) => [element('dt', {}, key), element('dd', {}, what)]));

    return async function trial(display) {
        const number = session.done,
            slots = session.person.slots;
        const slot = slots[number],
            view = session.study.views[slot.view];
        await session.stimuli.load(display, urls(slot), slots.slice(number + 1, number + 1 + AHEAD).flatMap(urls));
        const [judged, reference] = await Promise.all(urls(slot).map((url) => session.stimuli.bitmap(url)));
        const beside = window.innerWidth >= 2 * view.width + GAP + PANEL;
        const { box, show, seen } = stage(slot.side === 0 ? [judged, reference] : [reference, judged], view, beside);

        const which = element('h1', {}, beside ? 'A | B' : 'A');
        const hint = element('p.hint', { hidden: true }, say('validation.both'));
        const same = element('button', {}, say('validation.same')),
            different = element('button', {}, say('validation.different'));
        const question = element(
            'div',
            {},
            element('p', {}, say('validation.prompt')),
            element('div.row', {}, same, different),
        );
        const panel = element(
            'div.panel',
            {},
            which,
            element('p.hint', {}, say('validation.panel', { trial: number + 1, trials: slots.length })),
            question,
            hint,
            keyList(text('validation.switch').slice(beside ? 1 : 0)),
        );
        display.replaceChildren(element('div.work', {}, box, panel));
        const flip = (event) => {
            const to = { ArrowLeft: 0, ArrowRight: 1 }[event.key];
            if (to === undefined || beside) return;
            event.preventDefault();
            which.textContent = 'AB'[to];
            show(to);
        };
        document.addEventListener('keydown', flip);
        document.body.dataset.state = 'asking';
        const from = performance.now();
        await show(0);

        const keys = { [text('validation.keys.same')]: 1, [text('validation.keys.different')]: 0 };
        let answer = await choice(keys, [
            [same, 1],
            [different, 0],
        ]);
        while (!seen()) {
            hint.hidden = false;
            answer = await choice(keys, [
                [same, 1],
                [different, 0],
            ]);
        }
        hint.hidden = true;
        document.body.dataset.state = 'rating';
        const buttons = text('validation.ratings').map((line) => element('button', {}, line));
        question.replaceChildren(element('p', {}, say('validation.rate')), element('div.rating', {}, ...buttons));
        const rating = await choice(
            { 1: 1, 2: 2, 3: 3, 4: 4, 5: 5 },
            buttons.map((b, i) => [b, i + 1]),
        );
        document.removeEventListener('keydown', flip);
        document.body.dataset.state = 'storing';
        await session.store({
            slot: number,
            revision: 0,
            level: 0,
            answer,
            rating,
            ms: Math.round(performance.now() - from),
            layout: beside ? 'beside' : 'flip',
        });
    };
}
