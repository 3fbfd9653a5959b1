/* See wire.h. */
#define _GNU_SOURCE
#include "wire.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/futex.h>
#include <math.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define PATIENCE_MS 5000
#define SPIN_NS 200000LL /* before a wait goes to sleep */
#define SLICE_NS                                                               \
    100000000LL /* of a sleep; then the other side is looked at                \
                 */
#define NOT_STARTED 127

static const double start_values[MODEL_VALUES] = MODEL_START;

static void say(slave *s, const char *text) {
    if (s->log) {
        s->log(s->log_to, text);
    }
}

/* ---- the file names of a URI */
static int hexadecimal(char c) {
    if (c >= '0' && c <= '9') {
        return c - '0';
    }
    c |= 0x20;
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/* The path of a file: URI, or of a plain path; the caller frees it. */
static char *path_of_uri(const char *uri) {
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

/* ---- life */
/* A page without a name: nothing of it is left when both sides are gone. */
static int share(slave *s) {
    s->memory = memfd_create("hli-cosim-fmu", MFD_CLOEXEC);
    if (s->memory < 0 || ftruncate(s->memory, sizeof *s->page) != 0) {
        return -1;
    }
    void *page = mmap(NULL,
                      sizeof *s->page,
                      PROT_READ | PROT_WRITE,
                      MAP_SHARED,
                      s->memory,
                      0);
    if (page == MAP_FAILED) {
        return -1;
    }
    s->page = page;
    s->page->size = sizeof *s->page;
    memcpy(s->page->values, start_values, sizeof start_values);
    return 0;
}

slave *slave_new(const char *resources, wire_log log, void *log_to) {
    slave *s = calloc(1, sizeof *s);
    if (!s) {
        return NULL;
    }
    s->line = -1;
    s->memory = -1;
    s->log = log;
    s->log_to = log_to;
    s->resources = path_of_uri(resources);
    if (!s->resources || share(s) != 0) {
        slave_free(s);
        return NULL;
    }
    return s;
}

/* The interpreter of the export, or the one that the environment names. */
static const char *interpreter(void) {
    const char *named = getenv("HLI_COSIM_PYTHON");
    return named && *named ? named : MODEL_PYTHON;
}

/* In the new process: nothing of the importer but the page and the line. */
static void become(char *const words[], int line, int memory) {
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, NULL);
    syscall(SYS_close_range, 3U, ~0U, 4U /* CLOSE_RANGE_CLOEXEC */);
    fcntl(line, F_SETFD, 0);
    fcntl(memory, F_SETFD, 0);
    dup2(STDERR_FILENO, STDOUT_FILENO); /* the importer's output is its own */
    execvp(words[0], words);
    _exit(NOT_STARTED);
}

static int start(slave *s) {
    int pair[2];
    char line[16], memory[16], python[4096], module[] = "cnc_core.fmu.slave";
    char safe[] = "-P", run[] = "-m";
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0) {
        return -1;
    }
    snprintf(line, sizeof line, "%d", pair[1]);
    snprintf(memory, sizeof memory, "%d", s->memory);
    snprintf(python, sizeof python, "%s", interpreter());
    char *words[] =
        {python, safe, run, module, line, memory, s->resources, NULL};
    s->pid = fork();
    if (s->pid == 0) {
        become(words, pair[1], s->memory);
    }
    close(pair[1]);
    s->line = pair[0];
    return s->pid > 0 ? 0 : -1;
}

/* The process is gone: why, and nothing of it is left. */
static int say_end(slave *s) {
    char text[WIRE_TEXT];
    int status = 0;
    pid_t ended = s->pid > 0 ? waitpid(s->pid, &status, 0) : 0;
    int exited = ended == s->pid && WIFEXITED(status);
    if (exited && WEXITSTATUS(status) == NOT_STARTED) {
        snprintf(text,
                 sizeof text,
                 "%s cannot be started: set HLI_COSIM_PYTHON to a Python that"
                 " has hli-cosim",
                 interpreter());
    } else if (exited) {
        snprintf(text,
                 sizeof text,
                 "the process of the cell has ended with status %d: %s",
                 WEXITSTATUS(status),
                 "HLI_COSIM_PYTHON must name a Python that has hli-cosim");
    } else {
        snprintf(text, sizeof text, "the process of the cell has died");
    }
    s->pid = 0;
    say(s, text);
    slave_stop(s);
    return WIRE_ENDED;
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

/* ---- asking */
static int64_t now_ns(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return time.tv_sec * 1000000000LL + time.tv_nsec;
}

static int reached(const wire_word *word, uint32_t count) {
    return __atomic_load_n(&word->count, __ATOMIC_ACQUIRE) == count;
}

static void post(wire_word *word, uint32_t count) {
    __atomic_store_n(&word->count, count, __ATOMIC_SEQ_CST);
    if (__atomic_load_n(&word->waiters, __ATOMIC_SEQ_CST) != 0) {
        syscall(SYS_futex, &word->count, FUTEX_WAKE, INT32_MAX, NULL, NULL, 0);
    }
}

/* One sleep of a slice at most; spurious wakes do no harm. */
static void sleep_on(wire_word *word, uint32_t count) {
    struct timespec slice = {0, SLICE_NS};
    __atomic_fetch_add(&word->waiters, 1u, __ATOMIC_SEQ_CST);
    uint32_t seen = __atomic_load_n(&word->count, __ATOMIC_SEQ_CST);
    if (seen != count) {
        syscall(SYS_futex, &word->count, FUTEX_WAIT, seen, &slice, NULL, 0);
    }
    __atomic_fetch_sub(&word->waiters, 1u, __ATOMIC_SEQ_CST);
}

static int other_end_closed(const slave *s) {
    char none;
    return recv(s->line, &none, 1, MSG_PEEK | MSG_DONTWAIT) == 0;
}

/* 0, or -1: the process is gone. */
static int wait_for(slave *s, uint32_t count) {
    wire_word *answered = &s->page->answered;
    for (int64_t end = now_ns() + SPIN_NS; now_ns() < end; sched_yield()) {
        if (reached(answered, count)) {
            return 0;
        }
    }
    while (!reached(answered, count)) {
        sleep_on(answered, count);
        if (!reached(answered, count) && other_end_closed(s)) {
            return reached(answered, count) ? 0 : -1;
        }
    }
    return 0;
}

static uint32_t placed(slave *s, uint32_t kind, uint64_t cycles) {
    wire_page *page = s->page;
    page->kind = kind;
    page->cycles = cycles;
    page->failed = 0;
    page->text[0] = 0;
    uint32_t count = page->asked.count + 1;
    post(&page->asked, count);
    return count;
}

static int ask(slave *s, uint32_t kind, uint64_t cycles) {
    if (s->line < 0) {
        say(s, "the cell is not running");
        return WIRE_ENDED;
    }
    if (wait_for(s, placed(s, kind, cycles)) != 0) {
        return say_end(s);
    }
    s->page->text[WIRE_TEXT - 1] = 0;
    if (s->page->text[0]) {
        say(s, s->page->text);
    }
    return (int)s->page->failed;
}

int slave_setup(slave *s) {
    if (start(s) != 0) {
        say(s, strerror(errno));
        return WIRE_ENDED;
    }
    return ask(s, WIRE_SETUP, 0);
}

int slave_step(slave *s, double step) {
    double cycles = step / MODEL_CYCLE;
    double whole = round(cycles);
    if (!(whole >= 1.0) || !(whole <= 1e15) || fabs(cycles - whole) > 1e-6) {
        char text[WIRE_TEXT];
        snprintf(text,
                 sizeof text,
                 "a step of %g s is no multiple of the cell's cycle, %g s",
                 step,
                 MODEL_CYCLE);
        say(s, text);
        return WIRE_REFUSED;
    }
    return ask(s, WIRE_STEP, (uint64_t)whole);
}

int slave_hli(slave *s) {
    return ask(s, WIRE_HLI, 0);
}

void slave_stop(slave *s) {
    if (s->line >= 0) {
        placed(s, WIRE_END, 0);
        close(s->line);
        s->line = -1;
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
        if (s->page) {
            munmap(s->page, sizeof *s->page);
        }
        if (s->memory >= 0) {
            close(s->memory);
        }
        free(s->resources);
        free(s);
    }
}
