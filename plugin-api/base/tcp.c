#include "base/tcp.h"

#include <errno.h>
#include <netdb.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/options.h"

/* Cuts text into host and port; an IPv6 address without brackets has no port. 0: that is none. */
static int split(const char *text, char host[256], char port[8])
{
    const char *from = text, *end = strrchr(text, ':'), *named = NULL;
    if (text[0] == '[') {
        from = text + 1;
        end = strchr(text, ']');
        if (!end || (end[1] != '\0' && end[1] != ':'))
            return 0;
        named = end[1] == ':' ? end + 2 : NULL;
    } else if (end && strchr(text, ':') == end)
        named = end + 1;
    else
        end = text + strlen(text);
    int64_t number;
    if (end == from || end - from >= 256 || (named && !base_parse_integer(named, 1, 65535, &number)))
        return 0;
    snprintf(host, 256, "%.*s", (int)(end - from), from);
    if (named)
        snprintf(port, 8, "%d", (int)number);
    return 1;
}

int base_tcp_find(const char *text, const char *port, struct addrinfo **out, struct base_err *err)
{
    char host[256], number[8];
    const struct addrinfo hints = {.ai_family = AF_UNSPEC, .ai_socktype = SOCK_STREAM};
    snprintf(number, sizeof number, "%s", port);
    if (!split(text, host, number))
        return base_fail(err, BASE_EINVAL, "%.200s: expected HOST or HOST:PORT, the port from 1 to 65535", text);
    int code = getaddrinfo(host, number, &hints, out);
    if (code != 0)
        return base_fail(err, BASE_EINVAL, "%.200s: no such host (%s)", text, gai_strerror(code));
    return 0;
}

/* Until the socket can be written to; 0: not within wait_s. */
static int wait_for(int socket, double wait_s)
{
    struct pollfd p = {.fd = socket, .events = POLLOUT};
    return poll(&p, 1, (int)(wait_s * 1e3)) == 1;
}

int base_tcp_connect(const struct addrinfo *to, double wait_s)
{
    for (; to; to = to->ai_next) {
        int fd = socket(to->ai_family, to->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, to->ai_protocol), failed = 0;
        socklen_t size = sizeof failed;
        if (fd < 0)
            continue;
        if (connect(fd, to->ai_addr, to->ai_addrlen) == 0)
            return fd;
        if (errno == EINPROGRESS && wait_for(fd, wait_s) && getsockopt(fd, SOL_SOCKET, SO_ERROR, &failed, &size) == 0 &&
            failed == 0)
            return fd;
        close(fd);
    }
    return -1;
}

ptrdiff_t base_tcp_send(int socket, const void *data, size_t size, double wait_s)
{
    for (int waited = 0;; waited = 1) {
        ssize_t n = send(socket, data, size, MSG_NOSIGNAL);
        if (n >= 0)
            return n;
        if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)
            return -1;
        if (waited || !wait_for(socket, wait_s))
            return 0;
    }
}
