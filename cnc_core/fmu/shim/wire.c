/* See wire.h. */
#define _GNU_SOURCE
#include "wire.h"

#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#define PATIENCE_MS 5000
#define TEXT_MAX 2000

static const double start_values[MODEL_VALUES] = MODEL_START;

static void say(slave *s, const char *text) {
    if (s->log) {
        s->log(s->log_to, text);
    }
}

slave *slave_new(const char *resources, wire_log log, void *log_to) {
    slave *s = calloc(1, sizeof *s);
    if (!s) {
        return NULL;
    }
    s->handle = -1;
    s->log = log;
    s->log_to = log_to;
    s->resources = path_of_uri(resources);
    memcpy(s->values, start_values, sizeof start_values);
    if (!s->resources) {
        free(s);
        return NULL;
    }
    return s;
}

static int hexadecimal(char c) {
    if (c >= '0' && c <= '9') {
        return c - '0';
    }
    c |= 0x20;
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

char *path_of_uri(const char *uri) {
    static const char scheme[] = "file:";
    if (!uri) {
        return NULL;
    }
    char *path = malloc(strlen(uri) + 1);
    if (!path || strncmp(uri, scheme, sizeof scheme - 1) != 0) {
        return path ? strcpy(path, uri) : NULL;
    }
    uri += sizeof scheme - 1;
    if (uri[0] == '/' && uri[1] == '/') {
        uri = strchr(uri + 2, '/');
    }
    char *to = path;
    for (; uri && *uri; uri++) {
        int high = uri[0] == '%' ? hexadecimal(uri[1]) : -1;
        int low = high >= 0 ? hexadecimal(uri[2]) : -1;
        if (low >= 0) {
            *to++ = (char)(high * 16 + low);
            uri += 2;
        } else {
            *to++ = *uri;
        }
    }
    *to = 0;
    return path;
}

static int write_all(int handle, const void *data, size_t size) {
    const char *from = data;
    while (size > 0) {
        ssize_t n = send(handle, from, size, MSG_NOSIGNAL);
        if (n < 0 && errno == EINTR) {
            continue;
        }
        if (n <= 0) {
            return -1;
        }
        from += n;
        size -= (size_t)n;
    }
    return 0;
}

static int read_all(int handle, void *data, size_t size) {
    char *to = data;
    while (size > 0) {
        ssize_t n = recv(handle, to, size, MSG_WAITALL);
        if (n < 0 && errno == EINTR) {
            continue;
        }
        if (n <= 0) {
            return -1;
        }
        to += n;
        size -= (size_t)n;
    }
    return 0;
}

/* The interpreter of the export, or the one that the environment names. */
static const char *interpreter(void) {
    const char *named = getenv("HLI_COSIM_PYTHON");
    return named && *named ? named : MODEL_PYTHON;
}

static int start(slave *s) {
    int pair[2];
    char handle[16];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0) {
        return -1;
    }
    const char *python = interpreter();
    s->pid = fork();
    if (s->pid == 0) {
        /* a copy stays open in the new program */
        snprintf(handle, sizeof handle, "%d", dup(pair[1]));
        execlp(python,
               python,
               "-P",
               "-m",
               "cnc_core.fmu.slave",
               handle,
               s->resources,
               (char *)NULL);
        _exit(127);
    }
    close(pair[1]);
    s->handle = pair[0];
    return s->pid > 0 ? 0 : -1;
}

static void say_end(slave *s) {
    char text[TEXT_MAX];
    int status = 0;
    pid_t ended = s->pid > 0 ? waitpid(s->pid, &status, 0) : 0;
    if (ended == s->pid && WIFEXITED(status) && WEXITSTATUS(status) == 127) {
        snprintf(text,
                 sizeof text,
                 "%s cannot be started: set HLI_COSIM_PYTHON to a Python that"
                 " has hli-cosim",
                 interpreter());
    } else {
        snprintf(text, sizeof text, "the process of the cell has died");
    }
    s->pid = 0;
    say(s, text);
    slave_stop(s);
}

/* Reads an answer into the outputs. */
static int answer(slave *s) {
    uint32_t head[3];
    char text[TEXT_MAX];
    if (read_all(s->handle, head, sizeof head) != 0) {
        say_end(s);
        return -1;
    }
    for (uint32_t left = head[1]; left > 0;) {
        uint32_t part = left < TEXT_MAX - 1 ? left : TEXT_MAX - 1;
        if (read_all(s->handle, text, part) != 0) {
            say_end(s);
            return -1;
        }
        text[part] = 0;
        say(s, text);
        left -= part;
    }
    if (head[2] == MODEL_OUTPUTS) {
        size_t size = MODEL_OUTPUTS * sizeof(double);
        if (read_all(s->handle, s->values + MODEL_FIRST_OUTPUT, size) != 0) {
            say_end(s);
            return -1;
        }
    }
    return head[0] == 0 ? 0 : -1;
}

static int ask(slave *s,
               uint32_t kind,
               uint64_t cycles,
               uint32_t first,
               uint32_t count) {
    struct {
        uint32_t kind, count;
        uint64_t cycles;
    } head = {kind, count, cycles};
    if (s->handle < 0) {
        say(s, "the cell is not running");
        return -1;
    }
    if (write_all(s->handle, &head, sizeof head) != 0
        || write_all(s->handle, s->values + first, count * sizeof(double))
               != 0) {
        say_end(s);
        return -1;
    }
    return answer(s);
}

int slave_setup(slave *s) {
    if (start(s) != 0) {
        say(s, strerror(errno));
        return -1;
    }
    return ask(s, WIRE_SETUP, 0, 0, MODEL_FIRST_OUTPUT);
}

int slave_step(slave *s, double step) {
    double cycles = step / MODEL_CYCLE;
    double whole = round(cycles);
    if (!(whole >= 1.0) || fabs(cycles - whole) > 1e-6) {
        char text[TEXT_MAX];
        snprintf(text,
                 sizeof text,
                 "a step of %g s is no multiple of the cell's cycle, %g s",
                 step,
                 MODEL_CYCLE);
        say(s, text);
        return -1;
    }
    return ask(s, WIRE_STEP, (uint64_t)whole, MODEL_FIRST_INPUT, MODEL_INPUTS);
}

int slave_hli(slave *s) {
    struct {
        uint32_t kind, count;
        uint64_t cycles;
    } request = {WIRE_HLI, 0, 0};
    uint32_t head[3];
    if (s->handle < 0) {
        say(s, "the cell is not running");
        return -1;
    }
    if (write_all(s->handle, &request, sizeof request) != 0
        || read_all(s->handle, head, sizeof head) != 0) {
        say_end(s);
        return -1;
    }
    uint8_t *hli = realloc(s->hli, head[1] + 1);
    if (!hli) {
        say(s, "no memory");
        return -1;
    }
    s->hli = hli;
    s->hli_size = head[1];
    if (read_all(s->handle, hli, head[1]) != 0) {
        say_end(s);
        return -1;
    }
    return 0;
}

static int gone(pid_t pid) {
    for (int i = 0; i < PATIENCE_MS; i++) {
        if (waitpid(pid, NULL, WNOHANG) != 0) {
            return 1;
        }
        usleep(1000);
    }
    return 0;
}

void slave_stop(slave *s) {
    if (s->handle >= 0) {
        close(s->handle);
        s->handle = -1;
    }
    if (s->pid > 0 && !gone(s->pid)) {
        kill(s->pid, SIGTERM);
        if (!gone(s->pid)) {
            kill(s->pid, SIGKILL);
            waitpid(s->pid, NULL, 0);
        }
    }
    s->pid = 0;
}

void slave_free(slave *s) {
    if (s) {
        slave_stop(s);
        free(s->resources);
        free(s->hli);
        free(s);
    }
}
