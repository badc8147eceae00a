/* Monotonic and per-thread time in seconds. Thread-safe. */
#ifndef GGN_BASE_CLOCK_H
#define GGN_BASE_CLOCK_H

double ggn_clock_wall_s(void);   /* monotonic, arbitrary origin */
double ggn_clock_thread_s(void); /* CPU time of the calling thread */

#endif
