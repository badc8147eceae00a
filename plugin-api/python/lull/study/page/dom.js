// Elements, keys and waiting, in a few words.
import { say, text, fill } from './texts.js';

// element('p.hint', {hidden: true}, 'words', child, …)
export function element(kind, properties = {}, ...children) {
    const [tag, ...classes] = kind.split('.');
    const e = Object.assign(document.createElement(tag), properties);
    if (classes.length) e.className = classes.join(' ');
    e.append(...children.filter((c) => c !== null && c !== undefined));
    return e;
}

export function paragraphs(path, values = {}) {
    return text(path).map((line) => element('p', {}, fill(line, values)));
}

// A page of text with one button; resolves when it is pressed and `check` (a promise or value that is not false) agrees.
export function textPage(display, { title, children, button = say('continue'), check = () => true }) {
    return new Promise((resolve) => {
        const go = element('button', { type: 'submit' }, button);
        const form = element(
            'form.text',
            { noValidate: true },
            element('h1', {}, title),
            ...children,
            element('div.row', {}, go),
        );
        form.addEventListener('submit', async (event) => {
            event.preventDefault();
            go.disabled = true;
            const result = await check(form);
            go.disabled = false;
            if (result !== false) resolve(result);
        });
        display.replaceChildren(form);
        window.scrollTo(0, 0);
        (form.querySelector('input, button') ?? go).focus();
    });
}

export const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
export const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));

// Resolves to the value of the first key (of a map from KeyboardEvent.key to values) or button ([element, value]).
export function choice(keys, buttons = []) {
    return new Promise((resolve) => {
        const done = (value) => {
            document.removeEventListener('keydown', onKey);
            resolve(value);
        };
        const onKey = (event) => {
            const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
            if (event.repeat || !(key in keys) || paused()) return;
            event.preventDefault();
            done(keys[key]);
        };
        document.addEventListener('keydown', onKey);
        for (const [button, value] of buttons) button.onclick = () => done(value);
    });
}

// Whether a notice covers the study.
export function paused() {
    const notice = document.getElementById('notice');
    return !notice.hidden && !notice.classList.contains('strip');
}

export function showNotice(children, strip = false) {
    const notice = document.getElementById('notice');
    notice.className = strip ? 'strip' : '';
    notice.replaceChildren(element('div', {}, ...children));
    notice.hidden = false;
}

export function hideNotice() {
    document.getElementById('notice').hidden = true;
}

export function showProgress(done, of) {
    const bar = document.getElementById('progress');
    bar.hidden = false;
    bar.setAttribute('aria-valuenow', String(Math.round((100 * done) / of)));
    bar.firstElementChild.style.width = `${(100 * done) / of}%`;
}

document.addEventListener('keydown', (event) => {
    if (event.key.toLowerCase() !== 'f' || event.ctrlKey || event.metaKey || event.target.matches('input')) return;
    if (document.fullscreenElement) document.exitFullscreen();
    else document.documentElement.requestFullscreen?.().catch(() => {});
});
