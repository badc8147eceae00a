#define _GNU_SOURCE 1 /* RTLD_DEFAULT */
#include "geom/terminate.h"

#include <dlfcn.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

typedef void (*handler)(void);

static char line[200];
static int length;
static handler before;

static void say_and_end(void)
{
    (void)!write(STDERR_FILENO, line, (size_t)length);
    _exit(1);
}

/* std::set_terminate: a program in C has it by the libraries that are in C++, or needs none. */
static handler set(handler now)
{
    handler (*set_terminate)(handler);
    void *symbol = dlsym(RTLD_DEFAULT, "_ZSt13set_terminatePFvvE");
    memcpy(&set_terminate, &symbol, sizeof set_terminate); /* a pointer to data into one to a function */
    return set_terminate ? set_terminate(now) : NULL;
}

void pt_terminate_begin(const char *what)
{
    length = snprintf(line, sizeof line, "lull-render: out of memory (%s)\n", what);
    before = set(say_and_end);
}

void pt_terminate_end(void) { set(before); }
