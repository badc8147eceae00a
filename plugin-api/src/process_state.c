/* SPDX-License-Identifier: MIT */
#include "process_state.h"

#include <dirent.h>
#include <stddef.h>

#if defined(__SSE__)
#include <xmmintrin.h>

enum { MXCSR_STATUS = 0x3f }; /* sticky exception flags: any arithmetic sets them */

static unsigned long long fp_control_get(void) { return _mm_getcsr() & ~(unsigned)MXCSR_STATUS; }

static void fp_control_set(unsigned long long value) { _mm_setcsr((unsigned)value | (_mm_getcsr() & MXCSR_STATUS)); }
#elif defined(__aarch64__)
static unsigned long long fp_control_get(void)
{
    unsigned long long value;
    __asm__ volatile("mrs %0, fpcr" : "=r"(value));
    return value;
}

static void fp_control_set(unsigned long long value) { __asm__ volatile("msr fpcr, %0" : : "r"(value)); }
#else
static unsigned long long fp_control_get(void) { return 0; }

static void fp_control_set(unsigned long long value) { (void)value; }
#endif

void lull_process_state_read(struct lull_process_state *state)
{
    state->fp_control = fp_control_get();
    state->thread_count = 0;
    DIR *tasks = opendir("/proc/self/task");
    if (!tasks)
        return;
    for (struct dirent *e; (e = readdir(tasks)) != NULL;)
        state->thread_count += e->d_name[0] != '.';
    closedir(tasks);
}

void lull_process_state_restore(const struct lull_process_state *state) { fp_control_set(state->fp_control); }
