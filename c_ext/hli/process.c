/* Process identity for the HLI (see sync.h). */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include "hli/sync.h"

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <unistd.h>

/* State letter and start time of /proc/PID/stat; 0 on success. The command name
 * may hold anything, so the fields are counted from its last closing bracket.
 */
static int read_stat(int64_t pid, char *state, uint64_t *start) {
    char path[64], text[1024];
    snprintf(path, sizeof path, "/proc/%lld/stat", (long long)pid);
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) {
        return -1;
    }
    ssize_t got = read(fd, text, sizeof text - 1);
    close(fd);
    if (got <= 0) {
        return -1;
    }
    text[got] = 0;
    char *at = strrchr(text, ')');
    if (at == NULL || at[1] != ' ') {
        return -1;
    }
    at += 2;
    *state = *at;
    for (int field = 3; field < 22; field++) {
        at = strchr(at, ' ');
        if (at == NULL) {
            return -1;
        }
        at++;
    }
    *start = strtoull(at, NULL, 10);
    return 0;
}

uint64_t hs_process_start(int64_t pid) {
    char state;
    uint64_t start;
    return pid > 0 && read_stat(pid, &state, &start) == 0 ? start : 0;
}

int hs_process_alive(int64_t pid, uint64_t start) {
    char state;
    uint64_t now;
    if (pid <= 0 || read_stat(pid, &state, &now) != 0) {
        return 0;
    }
    return now == start && state != 'Z' && state != 'X';
}

int hs_die_with_parent(int signal, int64_t parent_pid) {
    if (prctl(PR_SET_PDEATHSIG, (unsigned long)signal, 0, 0, 0) != 0) {
        return -1;
    }
    return (int64_t)getppid() == parent_pid ? 0 : -1;
}
