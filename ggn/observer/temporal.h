/*
 * How visible noise is that is new in each frame of a moving picture, compared with the same noise standing still.
 *
 * A model, after ColorVideoVDP 0.5.7 (Mantiuk, Hanji, Ashraf, Asano, Chapiro, ACM TOG 43(4), 2024). A sustained and a
 * transient channel see a spatial frequency rho with the sensitivities S_s(rho) and S_t(rho) of castleCSF (Ashraf, Mantiuk,
 * Chapiro, Wuerger, Journal of Vision 24(4), 2024), behind temporal filters of 0.25 s. What stands still passes the first
 * alone, as it is. Of noise that is independent from frame to frame a filter leaves the root of the sum of its squared taps
 * |F|, and what two channels see adds in squares:
 *
 *     gain(rho) = sqrt(|F_s|^2 + (|F_t| S_t(rho) / S_s(rho))^2)
 *
 * At 24 frames per second that is 0.6 to 0.75 between 2 and 24 cycles per degree, 1.9 at 0.5: the eye averages fine noise
 * over frames, and sees coarse blotches come and go. Nobody was asked. Pure functions, thread-safe.
 */
#ifndef GGN_OBSERVER_TEMPORAL_H
#define GGN_OBSERVER_TEMPORAL_H

enum { GGN_TEMPORAL_BANDS = 12 };

struct ggn_temporal {
    double gain[GGN_TEMPORAL_BANDS]; /* [k] of the difference between neighbouring squares of 2^k px: sqrt(1/8) / 2^k
                                        cycles per pixel */
};

/* fps >= 0, 0: a still, whose gains are 1. pixels_per_degree > 0: of the display, as far away as it is looked at. */
void ggn_temporal_init(struct ggn_temporal *temporal, double fps, double pixels_per_degree);
/* Gain of noise [height][width] as seen, that is blurred: of its bands, each weighted by its mean square. Overwrites it. */
double ggn_temporal_gain(const struct ggn_temporal *temporal, float *noise, int width, int height);

#endif
