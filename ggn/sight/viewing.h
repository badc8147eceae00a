/*
 * How visible noise is as it is viewed, compared with what the observer was fitted to: a still, of which 67 pixels are a
 * degree. A model, after ColorVideoVDP 0.5.7 (Mantiuk, Hanji, Ashraf, Asano, Chapiro, ACM TOG 43(4), 2024). A sustained
 * and a transient channel see a spatial frequency rho with the sensitivities S_s(rho) and S_t(rho) of castleCSF (Ashraf,
 * Mantiuk, Chapiro, Wuerger, Journal of Vision 24(4), 2024), behind temporal filters of 0.25 s.
 *
 * - Distance: what stands still passes the sustained channel alone. A pattern of f cycles per pixel counts
 *
 *       still(f) = S_s(f ppd) / S_s(f 67)
 *
 *   Noise of single pixels fades where more of them are a degree, blotches do not: of white noise some 0.3 is left at 134.
 * - Motion: of noise that is independent from frame to frame a filter leaves the root of the sum of its squared taps |F|,
 *   and what two channels see adds in squares:
 *
 *       gain(f) = still(f) sqrt(|F_s|^2 + (|F_t| S_t(f ppd) / S_s(f ppd))^2)
 *
 *   At 24 frames per second the root is 0.6 to 0.75 between 2 and 24 cycles per degree, 1.9 at 0.5: the eye averages fine
 *   noise over frames, and sees coarse blotches come and go.
 *
 * Nobody was asked. Pure functions, thread-safe.
 */
#ifndef GGN_OBSERVER_VIEWING_H
#define GGN_OBSERVER_VIEWING_H

enum { GGN_VIEWING_BANDS = 12, GGN_VIEWING_PPD = 67 }; /* pixels per degree that the observer takes for granted */

/* [k] of the difference between neighbouring squares of 2^k px: sqrt(1/8) / 2^k cycles per pixel. */
struct ggn_viewing {
    double still[GGN_VIEWING_BANDS]; /* of what stands still */
    double gain[GGN_VIEWING_BANDS];  /* of noise */
};

/* fps >= 0, 0: a still. pixels_per_degree > 0: of the display, as far away as it is looked at; 67 is 0.7 m from a screen
 * 0.7 m wide with 3840 pixels, as in sight/flip.h. */
void ggn_viewing_init(struct ggn_viewing *viewing, double fps, double pixels_per_degree);
/* Gain of noise [height][width] as seen, that is blurred: of its bands, each weighted by its mean square. Overwrites it.
 * *still: that of an error with the same bands which stands still; NULL if nobody asks. */
double ggn_viewing_gain(const struct ggn_viewing *viewing, float *noise, int width, int height, double *still);

#endif
