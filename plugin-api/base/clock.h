/* Monotonic, per-thread and per-process time in seconds. Thread-safe. */
#ifndef BASE_CLOCK_H
#define BASE_CLOCK_H

double base_clock_wall_s(void);    /* monotonic, arbitrary origin */
double base_clock_thread_s(void);  /* CPU time of the calling thread */
double base_clock_process_s(void); /* CPU time of all threads together and of child processes */

#endif
