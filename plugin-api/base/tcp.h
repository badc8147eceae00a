/*
 * A TCP connection to somebody who may be slow, hostile or gone: no call but base_tcp_find waits longer than it is told,
 * none raises SIGPIPE, and no child inherits the socket. One thread at a time per socket.
 */
#ifndef BASE_TCP_H
#define BASE_TCP_H

#include <stddef.h>

#include "base/err.h"

struct addrinfo;

/* "HOST", "HOST:PORT" or "[IPv6]:PORT"; port is taken where none is named. May wait for a name server. *out is freed with
 * freeaddrinfo. BASE_EINVAL where there is no such host or port. */
int base_tcp_find(const char *text, const char *port, struct addrinfo **out, struct base_err *err);

/* A socket that never blocks, which the caller closes; -1: nobody answered within wait_s. */
int base_tcp_connect(const struct addrinfo *to, double wait_s);

/* Sends what the other side takes, and waits for at most wait_s until it takes something. The number of bytes; -1: it is
 * gone. */
ptrdiff_t base_tcp_send(int socket, const void *data, size_t size, double wait_s);

#endif
