// Pictures: fetched whole and before they are needed, decoded without any conversion.
import { element, wait } from './dom.js';
import { say } from './texts.js';

const AT_ONCE = 6;

export class Stimuli {
  blobs = new Map();
  bitmaps = new Map();

  async #fetch(url) {
    for (;;) {
      try {
        const response = await fetch(url);
        if (response.ok) return this.blobs.set(url, await response.blob());
      } catch { /* asked again */ }
      await wait(1000);
    }
  }

  // Loads what is not there yet, with a line that says so; forgets everything else.
  async load(display, urls) {
    const wanted = new Set(urls);
    for (const url of this.blobs.keys()) if (!wanted.has(url)) this.blobs.delete(url);
    for (const [url, bitmap] of this.bitmaps) if (!wanted.has(url)) { bitmap.close(); this.bitmaps.delete(url); }
    const missing = urls.filter((url) => !this.blobs.has(url)).reverse();
    if (missing.length === 0) return;
    const line = element('p', {}, say('loading'));
    display.replaceChildren(element('div.text', {}, line));
    const total = missing.length;
    await Promise.all(Array.from({ length: AT_ONCE }, async () => {
      for (let url; (url = missing.pop()) !== undefined;) {
        await this.#fetch(url);
        line.textContent = `${say('loading')} ${total - missing.length} / ${total}`;
      }
    }));
  }

  async bitmap(url) {
    if (!this.bitmaps.has(url))
      this.bitmaps.set(url, await createImageBitmap(this.blobs.get(url), { colorSpaceConversion: 'none', premultiplyAlpha: 'none' }));
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
