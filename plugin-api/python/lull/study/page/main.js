// The course of a study: consent, questions, screen, trials, thanks. jsPsych runs the time line; every step knows from what
// the server has whether it is still to be done, so that a link goes on where it was left.
import { Conflict, Refused, ask } from './api.js';
import { element, paragraphs, showNotice, showProgress, textPage } from './dom.js';
import { guardScreen, measureScreen } from './screen.js';
import { Stimuli } from './stimuli.js';
import { adjustment } from './task_adjustment.js';
import { twoInterval, wordsOf } from './task_2ifc.js';
import { validation } from './task_validation.js';
import { loadTexts, say, setAlways, text } from './texts.js';

const TASKS = { adjustment, '2ifc': twoInterval, validation };

// One step: `run(display)` does it and returns when it is done.
class Step {
    static info = {
        name: 'step',
        version: '1.0.0',
        parameters: { run: { type: jsPsychModule.ParameterType.FUNCTION } },
        data: {},
    };
    constructor(jsPsych) {
        this.jsPsych = jsPsych;
    }
    trial(display, { run }) {
        run(display).then(() => this.jsPsych.finishTrial({}), fail);
    }
}

function fail(error) {
    if (error instanceof Conflict) {
        const go = element('button', { onclick: () => window.location.reload() }, say('conflict.button'));
        showNotice([element('h1', {}, say('conflict.title')), element('p', {}, say('conflict.body')), go]);
        go.focus();
    } else {
        showNotice([
            element(
                'p',
                {},
                error instanceof Refused && error.status === 404 ? say('unknown') : say('failed', { why: error.message }),
            ),
        ]);
        console.error(error);
    }
}

// What the consent promises: whole fives, and never less than one.
const roughly = (minutes) => Math.max(5, 5 * Math.ceil(minutes / 5));

class Session {
    study = null;
    key = new URLSearchParams(window.location.search).get('p');
    person = null;
    stimuli = new Stimuli();

    async open() {
        this.study = await ask('api/study');
        setAlways({ asked_by: this.study.asked_by, contact: this.study.contact });
        if (this.key) await this.reload();
    }
    async reload() {
        this.person = await ask(`api/people/${encodeURIComponent(this.key)}`);
        this.progress();
    }
    get done() {
        return new Set(this.person.trials.map((t) => t.slot)).size;
    }
    get finished() {
        return this.done === this.person.slots.length;
    }
    progress() {
        showProgress(this.done, this.person.slots.length);
    }
    async store(trial) {
        await ask(`api/people/${this.key}/trials`, trial);
        this.person.trials.push(trial);
        this.progress();
    }
    async setProfile(part) {
        const profile = { ...this.person.profile, ...part };
        await ask(`api/people/${this.key}/profile`, profile);
        this.person.profile = profile;
    }
}

const session = new Session();

async function consent(display) {
    const box = element('input', { type: 'checkbox', name: 'consent' });
    await textPage(display, {
        title: say('consent.title'),
        children: [
            ...paragraphs('consent.body', { minutes: roughly(session.study.minutes) }),
            element('label.row', {}, box, say('consent.agree')),
        ],
        button: say('consent.button'),
        check: () => box.checked,
    });
    const { key } = await ask('api/people', { consent: true });
    session.key = key;
    window.history.replaceState(null, '', `?p=${key}`);
    await session.reload();
}

async function questions(display) {
    const items = text('questions.items');
    const warning = element('p.hint', { hidden: true }, say('questions.missing'));
    const answers = await textPage(display, {
        title: say('questions.title'),
        children: [
            ...items.map((item) =>
                element(
                    'fieldset',
                    {},
                    element('legend', {}, item.text),
                    ...item.options.map((option, i) =>
                        element('label', {}, element('input', { type: 'radio', name: item.name, value: i }), option),
                    ),
                ),
            ),
            warning,
        ],
        check: (form) => {
            const given = Object.fromEntries(
                items.map((item) => [item.name, item.options[new FormData(form).get(item.name)]]),
            );
            warning.hidden = items.every((item) => given[item.name] !== undefined);
            return warning.hidden ? given : false;
        },
    });
    await session.setProfile({ answers });
}

async function instructions(display) {
    const words = wordsOf(session.study);
    const blocks = session.study.views[0].blocks?.length;
    await textPage(display, {
        title: say(`${words}.title`),
        children: paragraphs(`${words}.body`, { blocks }),
        button: say('start'),
    });
}

async function takeBreak(display) {
    const of = session.person.slots.length;
    await textPage(display, {
        title: say('break.title'),
        children: [
            element('p', {}, say('break.body', { done: session.done, of })),
            element('p.hint', {}, say('break.link')),
        ],
    });
}

// The last page is none of jsPsych's steps: it empties the display after each of them.
function thanks(display) {
    display.replaceChildren(
        element(
            'div.text',
            {},
            element('h1', {}, say('thanks.title')),
            ...paragraphs('thanks.body', { id: session.person.id }),
        ),
    );
    document.body.dataset.state = 'finished';
}

const step = (run) => ({ type: Step, run });
const when = (needed, ...steps) => ({ timeline: steps.map(step), conditional_function: needed });

async function start() {
    await loadTexts();
    guardScreen();
    await session.open();
    const task = TASKS[session.study.task](session);
    const trial = async (display) => {
        const every = session.study.break_every,
            before = session.done;
        await task(display);
        if (every > 0 && Math.floor(session.done / every) > Math.floor(before / every) && !session.finished)
            await takeBreak(display);
    };
    const jsPsych = initJsPsych({ display_element: 'study' });
    await jsPsych.run([
        when(() => session.key === null, consent),
        when(() => session.person.profile.answers === undefined, questions),
        when(
            () => session.person.profile.screen === undefined,
            async (display) => session.setProfile({ screen: await measureScreen(display) }),
        ),
        when(() => !session.finished, instructions),
        {
            timeline: [{ timeline: [step(trial)], conditional_function: () => !session.finished }],
            loop_function: () => !session.finished,
        },
    ]);
    thanks(jsPsych.getDisplayElement());
}

start().catch(fail);
