/* The process behind an FMU instance, and the page that it shares with us;
   wire.py says the same in Python.  Own declarations; no header of the standard
   is needed. */
#ifndef HLI_COSIM_FMU_WIRE_H
#define HLI_COSIM_FMU_WIRE_H

#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#include "model.h" /* made at the export: counts, start values, cycle */

#define WIRE_TEXT 4096

enum {
    WIRE_SETUP = 1,
    WIRE_STEP = 2,
    WIRE_END = 3,
    WIRE_HLI = 4
};

/* What an answer is that did not go well: everything is as it was before, or
   the cell has ended. */
enum {
    WIRE_REFUSED = 1,
    WIRE_ENDED = 2
};

/* A count that goes up, and who sleeps on it; alone on its cache line. */
typedef struct {
    uint32_t count, waiters;
    uint8_t fill[56];
} wire_word;

/* What both processes see.  A request is written, then `asked` goes up; behind
   the answer `answered` goes up to the same count. */
typedef struct {
    wire_word asked, answered;
    uint32_t size, kind, failed, fill; /* failed: WIRE_REFUSED, WIRE_ENDED */
    uint64_t cycles;
    char text[WIRE_TEXT];    /* of an error, UTF-8 */
    char program[WIRE_TEXT]; /* empty: the one of the export */
    double values[MODEL_VALUES];
    uint8_t hli[MODEL_HLI_SIZE]; /* the channel's memory, as asked for last */
} wire_page;

typedef void (*wire_log)(void *to, const char *text);

/* One instance. */
typedef struct slave {
    wire_page *page;
    int memory; /* handle of the page */
    int line;   /* it closes with the process at its other end */
    pid_t pid;
    char *resources;
    wire_log log;
    void *log_to;
} slave;

/* `resources`: URI or plain path.  NULL: there are none, or no memory. */
slave *slave_new(const char *resources, wire_log log, void *log_to);

/* 0, or what went wrong: the reason has been logged. */
int slave_setup(slave *s);
int slave_step(slave *s, double step);
/* Fetches the channel's memory into the page; the same results. */
int slave_hli(slave *s);

/* Ends the process, if there is one, and waits for it. */
void slave_stop(slave *s);
void slave_free(slave *s);

#endif
