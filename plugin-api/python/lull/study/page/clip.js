// A clip in a loop: its frames lie below each other in one picture, which is decoded before the first is shown.
import { frame } from './dom.js';

const LONGEST = 9999; // ms that are told of a frame

// Shows `count` frames of a strip of `frames` at `fps`, and resolves to how long each stood, in ms by the clock of the animation
// frames: those are when the screen can change. 0: never drawn, since the next was due when the browser came to it.
export async function play(context, strip, { frames, fps, count }) {
    const { width, height } = context.canvas;
    const stood = Array(count).fill(0);
    let from = null,
        shown = -1,
        since = 0;
    for (;;) {
        const now = await frame();
        from ??= now;
        // A tenth of a frame early counts as due: screens of 60 Hz come a little before or after.
        const due = Math.floor(((now - from) * fps) / 1000 + 0.1);
        if (due === shown) continue;
        if (shown >= 0) stood[shown] = Math.min(LONGEST, Math.max(1, Math.round(now - since)));
        if (due >= count) return stood;
        context.drawImage(strip, 0, (due % frames) * height, width, height, 0, 0, width, height);
        shown = due;
        since = now;
    }
}
