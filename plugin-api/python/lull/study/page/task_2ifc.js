// Two-interval forced choice: a block clean and grainy, one after the other; QUEST+ per block chooses how grainy.
import { play } from './clip.js';
import { choice, element, frame, paused, wait } from './dom.js';
import { Quest } from './quest.js';
import { blockUrl, canvas } from './stimuli.js';
import { say } from './texts.js';

// Which of the texts speak of the task: grain is not all that denoised pictures may have.
export const wordsOf = (study) => (study.task === '2ifc' && study.views.some((v) => v.kind || v.frames) ? 'errors' : study.task);

export function twoInterval(session) {
    const words = wordsOf(session.study);
    const quests = new Map(); // of the view in hand, by block
    let viewInHand = -1;

    // What was answered before goes into the estimates, catch trials excepted.
    function questOf(view, index) {
        if (view !== viewInHand) quests.clear();
        viewInHand = view;
        if (!quests.has(index)) {
            const quest = new Quest(session.study.views[view].blocks[index].levels);
            for (const t of session.person.trials) learn(quest, view, index, t);
            quests.set(index, quest);
        }
        return quests.get(index);
    }

    function learn(quest, view, index, trial) {
        const slot = session.person.slots[trial.slot];
        if (slot.view === view && slot.block === index && !slot.catch)
            quest.update(trial.level, trial.answer === slot.side + 1);
    }

    // Resolves to how long each frame of clips stood, of stills to nothing.
    async function present(context, bitmaps, note, label, frames) {
        const { show_ms, gap_ms, fps, shown_frames } = session.study;
        const stood = [];
        note.textContent = '';
        await wait(gap_ms);
        for (let interval = 0; interval < 2; interval++) {
            note.textContent = label[interval];
            await frame();
            if (frames) {
                stood.push(...(await play(context, bitmaps[interval], { frames, fps, count: shown_frames })));
            } else {
                context.drawImage(bitmaps[interval], 0, 0);
                await wait(show_ms);
            }
            context.clearRect(0, 0, context.canvas.width, context.canvas.height);
            note.textContent = '';
            if (interval === 0) await wait(gap_ms);
        }
        return frames ? stood.join(' ') : undefined;
    }

    return async function trial(display) {
        const number = session.done;
        const slot = session.person.slots[number];
        const view = session.study.views[slot.view],
            block = view.blocks[slot.block];
        await session.stimuli.load(
            display,
            view.blocks.flatMap((b) => ['reference', 'heavy', ...b.levels].map((l) => blockUrl(slot.view, b, l))),
        );

        const level = slot.catch ? 0 : questOf(slot.view, slot.block).next();
        const clean = await session.stimuli.bitmap(blockUrl(slot.view, block, 'reference'));
        const grainy = await session.stimuli.bitmap(blockUrl(slot.view, block, level || 'heavy'));
        const picture = canvas(block.x1 - block.x0, block.y1 - block.y0);
        const note = element('div.interval');
        const first = element('button', {}, say(`${words}.answer_first`)),
            second = element('button', {}, say(`${words}.answer_second`));
        const prompt = element(
            'div.prompt',
            {},
            element('p', {}, say(`${words}.prompt`)),
            element('div.row', {}, first, second),
        );
        prompt.style.visibility = 'hidden';
        display.replaceChildren(element('div.trial', {}, note, picture, prompt));
        document.body.dataset.state = 'showing';
        while (paused()) await wait(200);
        const frame_ms = await present(
            picture.getContext('2d'),
            slot.side === 0 ? [grainy, clean] : [clean, grainy],
            note,
            [say(`${words}.first`), say(`${words}.second`)],
            view.frames,
        );

        prompt.style.visibility = 'visible';
        document.body.dataset.state = 'asking';
        const from = performance.now();
        const answer = await choice({ 1: 1, ArrowLeft: 1, 2: 2, ArrowRight: 2 }, [
            [first, 1],
            [second, 2],
        ]);
        document.body.dataset.state = 'storing';
        await session.store({
            slot: number,
            revision: 0,
            level,
            answer,
            rating: 0,
            ms: Math.round(performance.now() - from),
            frame_ms,
        });
        if (!slot.catch) learn(questOf(slot.view, slot.block), slot.view, slot.block, session.person.trials.at(-1));
    };
}
