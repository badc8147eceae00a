// What is on the screen: the words that must be there, nothing outside the window, covered or without ink. The screenshot is kept.
import { check } from './support.mjs';

const SURROUND = 119; // of the page, sRGB
const MIN_CONTRAST = 60; // codes between the darkest and the brightest pixel of a text

// In the page: the shown texts, controls and pictures with their rectangles, and what of them lies outside or is covered.
function things() {
    const notice = document.getElementById('notice');
    const root = !notice.hidden && !notice.classList.contains('strip') ? notice : document.body;
    const shown = (e) => e.checkVisibility({ checkVisibilityCSS: true, checkOpacity: true });
    const found = [],
        amiss = [];
    const clip = (e) => {
        let [x0, y0, x1, y1] = [0, 0, window.innerWidth, window.innerHeight];
        for (; e; e = e.parentElement) {
            if (getComputedStyle(e).overflow === 'visible') continue;
            const r = e.getBoundingClientRect();
            [x0, y0, x1, y1] = [Math.max(x0, r.left), Math.max(y0, r.top), Math.min(x1, r.right), Math.min(y1, r.bottom)];
        }
        return [x0, y0, x1, y1];
    };
    const add = (kind, what, e, r) => {
        const [x0, y0, x1, y1] = clip(e.parentElement);
        if (r.width < 1 || r.height < 1) amiss.push(`${what}: no size`);
        else if (r.left < x0 - 0.5 || r.top < y0 - 0.5 || r.right > x1 + 0.5 || r.bottom > y1 + 0.5)
            amiss.push(`${what}: outside, ${[r.left, r.top, r.right, r.bottom].map(Math.round)}`);
        else {
            const top = document.elementFromPoint((r.left + r.right) / 2, (r.top + r.bottom) / 2);
            if (!top || !(e.contains(top) || top.contains(e))) amiss.push(`${what}: covered by ${top?.outerHTML.slice(0, 60)}`);
            found.push({ kind, what, x: r.left, y: r.top, w: r.width, h: r.height });
        }
    };
    const texts = document.createTreeWalker(root, NodeFilter.SHOW_TEXT);
    for (let node; (node = texts.nextNode()); ) {
        const e = node.parentElement;
        if (node.data.trim() === '' || !shown(e) || e.closest('noscript, script')) continue;
        const range = document.createRange();
        range.selectNodeContents(node);
        for (const r of range.getClientRects()) add('text', node.data, e, r);
    }
    for (const e of root.querySelectorAll('input, .card')) if (shown(e)) add('control', e.name || e.className, e, e.getBoundingClientRect());
    for (const e of root.querySelectorAll('canvas')) if (shown(e)) add('picture', 'picture', e, e.getBoundingClientRect());
    const { scrollWidth, scrollHeight, clientWidth, clientHeight } = document.documentElement;
    if (scrollWidth > clientWidth || scrollHeight > clientHeight)
        amiss.push(`the page is ${scrollWidth}×${scrollHeight} in a window of ${clientWidth}×${clientHeight}`);
    return { found, amiss, words: root.innerText, ratio: window.devicePixelRatio };
}

// In another page: of every rectangle of a screenshot the darkest, the brightest and the largest difference to the surround.
async function measure({ png, found, ratio, surround }) {
    const bytes = Uint8Array.from(atob(png), (c) => c.charCodeAt(0));
    const bitmap = await createImageBitmap(new Blob([bytes]), { colorSpaceConversion: 'none' });
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d', { willReadFrequently: true });
    context.drawImage(bitmap, 0, 0);
    return found.map(({ x, y, w, h }) => {
        const d = context.getImageData(...[x, y, w, h].map((v) => Math.round(ratio * v))).data;
        const seen = { lo: 255, hi: 0, off: 0 };
        for (let i = 0; i < d.length; i++) {
            if (i % 4 === 3) continue;
            seen.lo = Math.min(seen.lo, d[i]);
            seen.hi = Math.max(seen.hi, d[i]);
            seen.off = Math.max(seen.off, Math.abs(d[i] - surround));
        }
        return seen;
    });
}

export class Looker {
    constructor(browser, folder) {
        this.browser = browser;
        this.folder = folder;
    }

    // words: must all be on the screen; pictures: so many canvases show something, the others show the surround.
    async look(page, name, words, pictures = 0) {
        this.page ??= await this.browser.newPage();
        await page.evaluate(() => document.fonts.ready);
        const png = await page.screenshot({ path: `${this.folder}/${name}.png` });
        const { found, amiss, words: there, ratio } = await page.evaluate(things);
        const seen = await this.page.evaluate(measure, { png: png.toString('base64'), found, ratio, surround: SURROUND });
        let drawn = 0;
        found.forEach(({ kind, what }, i) => {
            if (kind === 'picture') drawn += seen[i].off > 8;
            else if (seen[i].hi - seen[i].lo < (kind === 'text' ? MIN_CONTRAST : 8)) amiss.push(`${what}: cannot be seen`);
        });
        const plain = (text) => text.replace(/\s+/g, ' ');
        for (const word of words) if (!plain(there).includes(plain(word))) amiss.push(`missing: ${word}`);
        if (drawn !== pictures) amiss.push(`${drawn} pictures, wanted ${pictures}`);
        if (!found.some(({ kind }) => kind === 'text')) amiss.push('blank');
        check(amiss.length === 0, `on the screen: ${name}`, amiss.join('\n'));
    }

    // Screenshot of a part, as what `measure` says of it.
    async part(page, rectangle) {
        this.page ??= await this.browser.newPage();
        const png = await page.screenshot();
        const ratio = await page.evaluate(() => window.devicePixelRatio);
        return (await this.page.evaluate(measure, { png: png.toString('base64'), found: [rectangle], ratio, surround: SURROUND }))[0];
    }
}

