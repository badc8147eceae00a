/* Monotonic and per-thread time in seconds. Thread-safe. */
#ifndef PT_BASE_CLOCK_H
#define PT_BASE_CLOCK_H

double pt_clock_wall_s(void);   /* monotonic, arbitrary origin */
double pt_clock_thread_s(void); /* CPU time of the calling thread */

#endif
