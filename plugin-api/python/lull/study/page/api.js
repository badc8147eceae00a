// The server: what is asked for is asked again until it answers.
import { element, hideNotice, showNotice, wait } from './dom.js';
import { say } from './texts.js';

export class Conflict extends Error {}
export class Refused extends Error {
    constructor(status, why) {
        super(why);
        this.status = status;
    }
}

// GET, or POST when there is a body. Lost connections and failures of the server are waited out; the server recognises a
// repeated trial, so that sending again is safe.
export async function ask(path, body) {
    const options =
        body === undefined
            ? {}
            : { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(body) };
    let lost = false;
    for (let pause = 300; ; pause = Math.min(2 * pause, 5000)) {
        let response = null;
        try {
            response = await fetch(path, { ...options, cache: 'no-store' });
        } catch {
            /* no answer at all */
        }
        if (response && response.status < 500) {
            if (lost) hideNotice();
            if (response.ok) return response.json();
            const why = (await response.json().catch(() => ({}))).error ?? response.statusText;
            throw response.status === 409 ? new Conflict(why) : new Refused(response.status, why);
        }
        lost = true;
        showNotice([element('p', {}, say('connection'))], true);
        await wait(pause);
    }
}
