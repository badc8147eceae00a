/* SPDX-License-Identifier: MIT */
#define _GNU_SOURCE /* locale_t */
#include "process_state.h"

#include <dirent.h>
#include <pthread.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#if defined(__SSE__)
#include <xmmintrin.h>

enum { MXCSR_STATUS = 0x3f }; /* sticky exception flags: any arithmetic sets them */

unsigned long long lull_fp_control_get(void) { return _mm_getcsr() & ~(unsigned)MXCSR_STATUS; }

void lull_fp_control_set(unsigned long long value) { _mm_setcsr((unsigned)value | (_mm_getcsr() & MXCSR_STATUS)); }

/* The C library rounds decimals by this one. */
static unsigned short x87_control_get(void)
{
    unsigned short value;
    __asm__ volatile("fnstcw %0" : "=m"(value));
    return value;
}

static void x87_control_set(unsigned short value) { __asm__ volatile("fldcw %0" : : "m"(value)); }
#elif defined(__aarch64__)
unsigned long long lull_fp_control_get(void)
{
    unsigned long long value;
    __asm__ volatile("mrs %0, fpcr" : "=r"(value));
    return value;
}

void lull_fp_control_set(unsigned long long value) { __asm__ volatile("msr fpcr, %0" : : "r"(value)); }
#else
unsigned long long lull_fp_control_get(void) { return 0; }

void lull_fp_control_set(unsigned long long value) { (void)value; }
#endif

#if !defined(__SSE__)
static unsigned short x87_control_get(void) { return 0; }

static void x87_control_set(unsigned short value) { (void)value; }
#endif

static const int watched[LULL_STATE_SIGNALS] = {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGXFSZ};

void lull_thread_state_read(struct lull_process_state *state)
{
    const char *name = setlocale(LC_NUMERIC, NULL);
    memset(state, 0, sizeof *state);
    state->fp_control = lull_fp_control_get();
    state->x87_control = x87_control_get();
    pthread_sigmask(SIG_SETMASK, NULL, &state->blocked);
    state->thread_locale = uselocale((locale_t)0);
    if (name && strlen(name) < sizeof state->locale)
        strcpy(state->locale, name);
}

void lull_signal_state_read(struct lull_process_state *state)
{
    lull_thread_state_read(state);
    state->has_actions = 1;
    for (int i = 0; i < LULL_STATE_SIGNALS; i++)
        sigaction(watched[i], NULL, &state->actions[i]);
}

void lull_process_state_read(struct lull_process_state *state)
{
    lull_signal_state_read(state);
    DIR *tasks = opendir("/proc/self/task");
    if (!tasks)
        return;
    for (struct dirent *e; (e = readdir(tasks)) != NULL;)
        state->thread_count += e->d_name[0] != '.';
    closedir(tasks);
}

static const char *restore_actions(const struct lull_process_state *state)
{
    const char *changed = NULL;
    struct sigaction now;
    for (int i = 0; i < LULL_STATE_SIGNALS && state->has_actions; i++) {
        const struct sigaction *before = &state->actions[i];
        if (sigaction(watched[i], NULL, &now) != 0 || now.sa_handler == before->sa_handler)
            continue;
        sigaction(watched[i], before, NULL);
        changed = "what a signal does";
    }
    return changed;
}

const char *lull_process_state_restore(const struct lull_process_state *state)
{
    struct lull_process_state now;
    const char *changed = restore_actions(state);
    lull_thread_state_read(&now);
    if (memcmp(&now.blocked, &state->blocked, sizeof now.blocked) != 0) {
        pthread_sigmask(SIG_SETMASK, &state->blocked, NULL);
        changed = "which signals are blocked";
    }
    if (now.thread_locale != state->thread_locale) {
        uselocale(state->thread_locale);
        changed = "the locale of the thread";
    }
    if (state->locale[0] != '\0' && strcmp(now.locale, state->locale) != 0) {
        setlocale(LC_NUMERIC, state->locale);
        changed = "the decimal point of the locale";
    }
    if (now.x87_control != state->x87_control) {
        x87_control_set(state->x87_control);
        changed = "the rounding of decimals";
    }
    if (now.fp_control != state->fp_control) {
        lull_fp_control_set(state->fp_control);
        changed = "the floating-point control register";
    }
    return changed;
}
