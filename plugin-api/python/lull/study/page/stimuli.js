// Pictures: fetched whole and before they are needed, decoded without any conversion.
import { element, wait } from './dom.js';
import { say } from './texts.js';

const AT_ONCE = 6;

export class Stimuli {
    blobs = new Map();
    bitmaps = new Map();
    wanted = new Set();
    fetching = new Map(); // url → promise

    async #get(url) {
        while (this.wanted.has(url)) {
            try {
                const response = await fetch(url);
                if (response.ok) {
                    this.blobs.set(url, await response.blob());
                    break;
                }
            } catch {
                // asked again
            }
            await wait(1000);
        }
        this.fetching.delete(url);
    }

    #fetch(url) {
        if (this.blobs.has(url)) return undefined;
        if (!this.fetching.has(url)) this.fetching.set(url, this.#get(url));
        return this.fetching.get(url);
    }

    // Returns when all of urls are there, with a line that says how far it is; goes on in the background with what is wanted
    // next. Everything else is forgotten.
    async load(display, urls, next = []) {
        this.wanted = new Set([...urls, ...next]);
        for (const url of this.blobs.keys()) if (!this.wanted.has(url)) this.blobs.delete(url);
        for (const [url, bitmap] of this.bitmaps) {
            if (this.wanted.has(url)) continue;
            bitmap.close();
            this.bitmaps.delete(url);
        }
        const missing = urls.filter((url) => !this.blobs.has(url)).reverse();
        const total = missing.length;
        if (total > 0) {
            const line = element('p', {}, say('loading'));
            display.replaceChildren(element('div.text', {}, line));
            const worker = async () => {
                for (let url; (url = missing.pop()) !== undefined;) {
                    await this.#fetch(url);
                    line.textContent = `${say('loading')} ${total - missing.length} / ${total}`;
                }
            };
            await Promise.all(Array.from({ length: AT_ONCE }, worker));
        }
        for (const url of next) this.#fetch(url);
    }

    async bitmap(url) {
        if (!this.bitmaps.has(url))
            this.bitmaps.set(
                url,
                await createImageBitmap(this.blobs.get(url), { colorSpaceConversion: 'none', premultiplyAlpha: 'none' }),
            );
        return this.bitmaps.get(url);
    }
}

export const blockUrl = (view, block, what) => `stimuli/v${view}/b${block.id}-${what}.png`;
export const pictureUrl = (view, name) => `stimuli/v${view}/${name}.png`;

export function canvas(width, height) {
    const c = element('canvas', { width, height });
    c.style.width = `${width}px`;
    c.style.height = `${height}px`;
    return c;
}
