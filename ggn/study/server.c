#include "study/server.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netinet/in.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <microhttpd.h>

enum { MAX_CONNECTIONS = 1024, IDLE_S = 120, MAX_HOSTS = 4, HEADER_MEMORY = 32768 };

/* --- address --- */

int ggn_study_address_parse(const char *text, struct ggn_study_address *address, struct base_err *err)
{
    struct ggn_study_address a = {.port = GGN_STUDY_PORT, .ipv6 = text[0] == '['};
    const char *host = text + a.ipv6, *end = strchr(host, a.ipv6 ? ']' : ':');
    const char *port = a.ipv6 ? (end ? end + 1 : NULL) : end;
    size_t n = end ? (size_t)(end - host) : strlen(host);
    unsigned char bytes[16];
    char *rest = NULL;
    if (n >= sizeof a.host || (a.ipv6 && (!end || (*port != ':' && *port != '\0'))))
        return base_fail(err, BASE_EINVAL, "--listen %.64s: expected ADDRESS, ADDRESS:PORT or [ADDRESS6]:PORT", text);
    memcpy(a.host, host, n);
    if (inet_pton(a.ipv6 ? AF_INET6 : AF_INET, a.host, bytes) != 1)
        return base_fail(err, BASE_EINVAL, "--listen %.64s: not an address in numbers, like 127.0.0.1 or [::1]", text);
    if (port && *port == ':') {
        long value = strtol(port + 1, &rest, 10);
        if (port[1] < '0' || port[1] > '9' || *rest != '\0' || value < 0 || value > 65535)
            return base_fail(err, BASE_EINVAL, "--listen %.64s: a port is 0 … 65535", text);
        a.port = (int)value;
    }
    a.loopback = a.ipv6 ? memcmp(bytes, &in6addr_loopback, 16) == 0 : bytes[0] == 127;
    *address = a;
    return 0;
}

/* --- requests --- */

struct server {
    struct ggn_study_site site;
    char names[MAX_HOSTS][80];
    const char *hosts[MAX_HOSTS + 1];
};

struct upload { /* a request being received */
    char *body; /* owns */
    size_t size, room;
    int too_large, no_memory;
};

/* One line per refusal; what came from outside is printed without control characters. */
static void log_refusal(const char *method, const char *url, int status, const char *why)
{
    char clean[160], at[32];
    size_t n = 0;
    time_t now = time(NULL);
    struct tm tm;
    for (; url[n] && n < sizeof clean - 1; n++)
        clean[n] = url[n] >= ' ' && url[n] <= '~' ? url[n] : '?';
    clean[n] = '\0';
    gmtime_r(&now, &tm);
    strftime(at, sizeof at, "%Y-%m-%dT%H:%M:%SZ", &tm);
    fprintf(stderr, "%s refused %d %.8s %s: %s\n", at, status, method, clean, why);
}

static enum MHD_Result send_response(struct MHD_Connection *c, struct ggn_study_response *r)
{
    struct MHD_Response *m;
    if (r->fd >= 0) {
        m = MHD_create_response_from_fd(r->size, r->fd); /* closes it */
        if (!m)
            close(r->fd);
    } else {
        m = MHD_create_response_from_buffer(r->size, r->body, MHD_RESPMEM_MUST_FREE);
        if (!m)
            free(r->body);
    }
    if (!m)
        return MHD_NO;
    MHD_add_response_header(m, MHD_HTTP_HEADER_CONTENT_TYPE, r->type);
    MHD_add_response_header(m, MHD_HTTP_HEADER_CACHE_CONTROL, r->keep ? "private, max-age=31536000, immutable" : "no-store");
    MHD_add_response_header(m, "X-Content-Type-Options", "nosniff");
    MHD_add_response_header(m, "X-Frame-Options", "DENY");
    MHD_add_response_header(m, "Referrer-Policy", "no-referrer"); /* the address holds the token and the person's key */
    MHD_add_response_header(m, "Cross-Origin-Resource-Policy", "same-origin");
    /* unsafe-eval: the QUEST+ library's numeric part makes its loops with Function(); scripts still come from here alone */
    MHD_add_response_header(
        m, "Content-Security-Policy",
        "default-src 'none'; script-src 'self' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
        "img-src 'self' blob: data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
    enum MHD_Result sent = MHD_queue_response(c, (unsigned)r->status, m);
    MHD_destroy_response(m);
    return sent;
}

static void receive(struct upload *u, const char *data, size_t size)
{
    if (u->size + size > GGN_STUDY_BODY_MAX)
        u->too_large = 1;
    if (u->too_large || u->no_memory)
        return;
    if (u->size + size > u->room) {
        size_t room = u->room ? 2 * u->room : 1024;
        while (room < u->size + size)
            room *= 2;
        char *body = realloc(u->body, room);
        if (!body) {
            u->no_memory = 1;
            return;
        }
        u->body = body;
        u->room = room;
    }
    memcpy(u->body + u->size, data, size);
    u->size += size;
}

static enum MHD_Result on_request(void *data, struct MHD_Connection *c, const char *url, const char *method,
                                  const char *version, const char *upload, size_t *upload_size, void **context)
{
    const struct server *s = data;
    struct upload *u = *context;
    (void)version;
    if (!u) {
        *context = calloc(1, sizeof *u);
        return *context ? MHD_YES : MHD_NO;
    }
    if (*upload_size > 0) {
        receive(u, upload, *upload_size);
        *upload_size = 0;
        return MHD_YES;
    }
    struct ggn_study_response r = {.fd = -1};
    if (u->too_large)
        ggn_study_refuse(&r, MHD_HTTP_CONTENT_TOO_LARGE, "the body is too large");
    else if (u->no_memory)
        ggn_study_refuse(&r, MHD_HTTP_INTERNAL_SERVER_ERROR, "out of memory");
    else
        ggn_study_answer(&s->site,
                         &(struct ggn_study_request){
                             .method = method,
                             .path = url,
                             .body = u->body,
                             .size = u->size,
                             .host = MHD_lookup_connection_value(c, MHD_HEADER_KIND, MHD_HTTP_HEADER_HOST),
                             .origin = MHD_lookup_connection_value(c, MHD_HEADER_KIND, MHD_HTTP_HEADER_ORIGIN),
                             .fetch_site = MHD_lookup_connection_value(c, MHD_HEADER_KIND, "Sec-Fetch-Site"),
                             .content_type = MHD_lookup_connection_value(c, MHD_HEADER_KIND, MHD_HTTP_HEADER_CONTENT_TYPE)},
                         &r);
    if (r.why[0] != '\0')
        log_refusal(method, url, r.status, r.why);
    return send_response(c, &r);
}

/* Nothing here has a name that needs escapes, so none is undone: what holds a '%' names nothing. */
static size_t on_unescape(void *data, struct MHD_Connection *c, char *text)
{
    (void)data, (void)c;
    return strlen(text);
}

static void on_done(void *data, struct MHD_Connection *c, void **context, enum MHD_RequestTerminationCode why)
{
    struct upload *u = *context;
    (void)data, (void)c, (void)why;
    if (u)
        free(u->body);
    free(u);
    *context = NULL;
}

static void on_log(void *data, const char *format, va_list arguments)
{
    char text[300];
    (void)data;
    vsnprintf(text, sizeof text, format, arguments);
    text[strcspn(text, "\r\n")] = '\0';
    fprintf(stderr, "server: %s\n", text);
}

/* --- running --- */

static void know_hosts(struct server *s, const struct ggn_study_address *a, int port)
{
    if (!a->loopback) {
        s->site.hosts = NULL;
        return;
    }
    snprintf(s->names[0], sizeof s->names[0], a->ipv6 ? "[%s]:%d" : "%s:%d", a->host, port);
    snprintf(s->names[1], sizeof s->names[1], "localhost:%d", port);
    s->hosts[0] = s->names[0];
    s->hosts[1] = s->names[1];
    s->hosts[2] = NULL;
    s->site.hosts = s->hosts;
}

/* A bound socket and its port, so that the names by which it may be called are known before the first request. */
static int listen_on(const struct ggn_study_address *a, int *port, struct base_err *err)
{
    union {
        struct sockaddr any;
        struct sockaddr_in in4;
        struct sockaddr_in6 in6;
    } at = {0};
    socklen_t size = a->ipv6 ? sizeof at.in6 : sizeof at.in4;
    int yes = 1, fd = socket(a->ipv6 ? AF_INET6 : AF_INET, SOCK_STREAM, 0);
    at.any.sa_family = a->ipv6 ? AF_INET6 : AF_INET;
    if (a->ipv6)
        at.in6.sin6_port = htons((uint16_t)a->port);
    else
        at.in4.sin_port = htons((uint16_t)a->port);
    inet_pton(at.any.sa_family, a->host, a->ipv6 ? (void *)&at.in6.sin6_addr : (void *)&at.in4.sin_addr);
    if (fd < 0 || setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 || bind(fd, &at.any, size) != 0 ||
        listen(fd, SOMAXCONN) != 0 || getsockname(fd, &at.any, &size) != 0) {
        base_fail(err, BASE_EINVAL, "cannot listen on %s, port %d: %s", a->host, a->port, strerror(errno));
        if (fd >= 0)
            close(fd);
        return -1;
    }
    *port = ntohs(a->ipv6 ? at.in6.sin6_port : at.in4.sin_port);
    return fd;
}

int ggn_study_serve(const struct ggn_study_site *site, const struct ggn_study_address *a, const volatile sig_atomic_t *stop,
                    struct base_err *err)
{
    struct server s = {.site = *site};
    int port = 0, fd = listen_on(a, &port, err);
    if (fd < 0)
        return BASE_EINVAL;
    know_hosts(&s, a, port);
    /* Not epoll: libmicrohttpd 0.9.75 then misses a connection's end that comes together with data and waits IDLE_S. */
    struct MHD_Daemon *daemon =
        MHD_start_daemon(MHD_USE_POLL_INTERNAL_THREAD | MHD_USE_ERROR_LOG, 0, NULL, NULL, on_request, &s,
                         MHD_OPTION_EXTERNAL_LOGGER, on_log, NULL, MHD_OPTION_LISTEN_SOCKET, (MHD_socket)fd,
                         MHD_OPTION_NOTIFY_COMPLETED, on_done, NULL, MHD_OPTION_UNESCAPE_CALLBACK, on_unescape, NULL,
                         MHD_OPTION_CONNECTION_LIMIT, (unsigned)MAX_CONNECTIONS, MHD_OPTION_CONNECTION_TIMEOUT,
                         (unsigned)IDLE_S, MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)HEADER_MEMORY, MHD_OPTION_END);
    if (!daemon) {
        close(fd);
        return base_fail(err, BASE_EIO, "the server does not start");
    }
    printf(a->ipv6 ? "http://[%s]:%d/%s%s\n" : "http://%s:%d/%s%s\n", a->host, port, site->token ? site->token : "",
           site->token ? "/" : "");
    fflush(stdout);
    int rc = 0;
    while (!*stop && (rc = ggn_study_store_check(site->store, err)) == 0)
        nanosleep(&(struct timespec){.tv_nsec = 100000000}, NULL);
    MHD_stop_daemon(daemon); /* closes the socket */
    return rc;
}
