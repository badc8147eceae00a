// QUEST+ (Watson 2017) over log2 of the samples per pixel, for two-interval forced choice.
//
//   P(correct | x) = 1/2 + (1 - lapse)/2 · Phi((t - x) / s),   x, t in octaves, s the spread
//
// The same model, on a finer grid and with the person's bias for one interval, gives the estimates of `lull-study report`
// (psychometric.py); here it only chooses what to show next.
import QuestPlus from './vendor/questplus.js';

const STEP = 0.25; // octaves between threshold hypotheses
const MARGIN = 1; // octaves beyond the levels
const SPREADS = [0.25, 0.5, 1];
const LAPSES = [0.02, 0.1];

export class Quest {
    #levels;
    #quest;

    // levels: samples per pixel, rising.
    constructor(levels) {
        this.#levels = levels;
        const x = levels.map(Math.log2);
        const first = x[0] - MARGIN;
        const count = Math.floor((x.at(-1) + MARGIN - first) / STEP) + 1;
        const correct = (level, t, s, lapse) => 0.5 + 0.5 * (1 - lapse) * QuestPlus.normcdf(t - level, 0, s);
        this.#quest = new QuestPlus({
            psych_func: [(...p) => 1 - correct(...p), correct],
            stim_samples: [x],
            psych_samples: [Array.from({ length: count }, (_, i) => first + STEP * i), SPREADS, LAPSES],
        });
    }

    // The level that is expected to tell most.
    next() {
        return this.#levels[this.#quest.comb_stim_params.indexOf(this.#quest.getStimParams())];
    }

    update(level, correct) {
        this.#quest.update(this.#quest.comb_stim_params[this.#levels.indexOf(level)], correct ? 1 : 0);
    }
}
