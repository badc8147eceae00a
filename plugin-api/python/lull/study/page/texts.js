// What the page says: texts.json of the study. `say("break.body", {done: 3, of: 9})`.
let texts = {};
let always = {}; // values that any text may use

export async function loadTexts() {
    texts = await (await fetch('texts.json')).json();
    document.documentElement.lang = texts.language;
    document.title = texts.title;
}

export function setAlways(values) {
    always = values;
}

export function text(path) {
    return path.split('.').reduce((o, key) => o?.[key], texts) ?? path;
}

export function say(path, values = {}) {
    return fill(text(path), values);
}

export function fill(line, values) {
    return String(line).replace(/\{(\w+)\}/g, (whole, key) => values[key] ?? always[key] ?? whole);
}
