// The screen: refusal of what would scale the pictures, and what is measured of it.
import { element, hideNotice, paragraphs, showNotice, textPage } from './dom.js';
import { say } from './texts.js';

const CARD_MM = 85.6; // ISO/IEC 7810 ID-1
const MIN_WIDTH = 1000,
    MIN_HEIGHT = 600;

// null, or the words for why pictures cannot be shown pixel for pixel now.
function refusal() {
    const ratio = window.devicePixelRatio;
    const pinch = window.visualViewport?.scale ?? 1;
    // Zooming scales the page inside the same window; bars and borders of windows take far less than a tenth of the width.
    const zoom = window.outerWidth > 0 ? window.outerWidth / window.innerWidth : 1;
    if (Math.abs(pinch - 1) > 0.01) return say('refuse.zoom', { zoom: Math.round(100 * pinch) });
    if (zoom > 1.1 || zoom < 0.9) return say('refuse.zoom', { zoom: Math.round(100 * zoom) });
    if (Math.abs(ratio - Math.round(ratio)) > 0.001 || ratio < 1) return say('refuse.ratio', { ratio: ratio.toFixed(2) });
    if (window.innerWidth < MIN_WIDTH || window.innerHeight < MIN_HEIGHT)
        return say('refuse.small', { width: window.innerWidth, height: window.innerHeight });
    return null;
}

let refused = false;

function look() {
    const why = refusal();
    if (why) showNotice([element('h1', {}, say('refuse.title')), element('p', {}, why)]);
    else if (refused) hideNotice();
    refused = why !== null;
}

// Looks now and whenever something changes, and covers the study while it cannot be shown as it must be.
export function guardScreen() {
    look();
    for (const event of ['resize', 'fullscreenchange']) window.addEventListener(event, look);
    window.visualViewport?.addEventListener('resize', look);
    setInterval(look, 1000);
}

async function measureCard(display) {
    const box = element('div.card');
    const slider = element('input', { type: 'range', min: 120, max: 900, step: 1, value: 324, name: 'card' });
    const warning = element('p.hint', { hidden: true });
    const size = () => {
        box.style.width = `${slider.value}px`;
        box.style.height = `${(slider.value * 53.98) / CARD_MM}px`;
    };
    slider.oninput = size;
    size();
    let warned = null;
    return textPage(display, {
        title: say('card.title'),
        children: [...paragraphs('card.body'), element('label.row', {}, say('card.label'), slider), box, warning],
        check: () => {
            const perMm = slider.value / CARD_MM,
                ppi = perMm * 25.4;
            if ((ppi < 60 || ppi > 260) && warned !== slider.value) {
                warned = slider.value;
                warning.textContent = say('card.unlikely', { ppi: Math.round(ppi) });
                warning.hidden = false;
                return false;
            }
            return perMm;
        },
    });
}

async function askDistance(display) {
    const input = element('input', { type: 'number', min: 20, max: 300, value: 60, name: 'distance' });
    const warning = element('p.hint', { hidden: true }, say('distance.missing'));
    return textPage(display, {
        title: say('distance.title'),
        children: [...paragraphs('distance.body'), element('label.row', {}, say('distance.label'), input), warning],
        check: () => {
            const cm = Number(input.value);
            warning.hidden = cm >= 20 && cm <= 300;
            return warning.hidden ? cm : false;
        },
    });
}

// Lines of black and white look half as bright as white; the code of an equal grey tells the exponent of the screen.
async function measureGamma(display) {
    const W = 240,
        H = 160;
    const stripes = element('canvas', { width: W, height: H }),
        plain = element('canvas', { width: W, height: H });
    const lines = stripes.getContext('2d'),
        field = plain.getContext('2d');
    for (let y = 0; y < H; y++) {
        lines.fillStyle = y % 2 ? '#000' : '#fff';
        lines.fillRect(0, y, W, 1);
    }
    const slider = element('input', { type: 'range', min: 90, max: 240, step: 1, value: 128, name: 'gamma' });
    const warning = element('p.hint', { hidden: true });
    const paint = () => {
        field.fillStyle = `rgb(${slider.value},${slider.value},${slider.value})`;
        field.fillRect(0, 0, W, H);
    };
    slider.oninput = paint;
    paint();
    let warned = null;
    return textPage(display, {
        title: say('gamma.title'),
        children: [
            ...paragraphs('gamma.body'),
            element('div.gamma', {}, stripes, plain),
            element('label.row', {}, say('gamma.label'), slider),
            warning,
        ],
        check: () => {
            const gamma = Math.log(0.5) / Math.log(slider.value / 255);
            if ((gamma < 1.7 || gamma > 2.8) && warned !== slider.value) {
                warned = slider.value;
                warning.textContent = say('gamma.unusual', { gamma: gamma.toFixed(1) });
                warning.hidden = false;
                return false;
            }
            return gamma;
        },
    });
}

// {pixels_per_mm, distance_cm, pixels_per_degree, gamma, …}: CSS pixels, which are the pixels of the pictures.
export async function measureScreen(display) {
    const perMm = await measureCard(display);
    const cm = await askDistance(display);
    const gamma = await measureGamma(display);
    return {
        pixels_per_mm: Number(perMm.toFixed(3)),
        distance_cm: cm,
        pixels_per_degree: Number((perMm * 10 * cm * 2 * Math.tan(Math.PI / 360)).toFixed(2)),
        gamma: Number(gamma.toFixed(2)),
        device_pixel_ratio: window.devicePixelRatio,
        screen: [window.screen.width, window.screen.height],
        window: [window.innerWidth, window.innerHeight],
    };
}
