/* Without feedback, so many times as fast as a fuzzer: inputs of a list of
 * files, one name a line, changed at random and run. The input that is running
 * is written to a file when it breaks something. */
#include <malloc.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#ifndef __has_feature /* a word of clang */
#define __has_feature(name) 0
#endif
#define INPUTS_MAX 20000
#define LONGEST 4096
#define CHANGES_MAX 4
#define LARGE (1 << 18) /* bytes: more comes as zeros from the system */

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
#if __has_feature(address_sanitizer)
void __sanitizer_set_death_callback(void (*callback)(void));
#endif

struct input {
    uint8_t *data;
    size_t size;
};

static struct input inputs[INPUTS_MAX];
static size_t count, longest;
static uint8_t running[LONGEST];
static size_t running_size;
static const char *kept; /* name of the file for an input that breaks */
static uint64_t state;

/* xorshift64*, by its published constants. */
static uint32_t any(uint32_t below) {
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return (uint32_t)((state * 2685821657736338717u >> 32) % below);
}

static void keep(void) {
    FILE *file = fopen(kept, "wb");
    if (file) {
        fwrite(running, 1, running_size, file);
        fclose(file);
    }
}

static void on_signal(int number) {
    keep();
    _exit(128 + number);
}

static void load(const char *name) {
    FILE *file = fopen(name, "rb");
    struct input *input = &inputs[count];
    if (!file) {
        fprintf(stderr, "%s: cannot be read\n", name);
        exit(2);
    }
    input->data = malloc(longest);
    input->size = fread(input->data, 1, longest, file);
    fclose(file);
    count += input->size > 0;
}

/* Bytes of another input in the place of those that are there. */
static void splice(void) {
    const struct input *other = &inputs[any((uint32_t)count)];
    size_t from = any((uint32_t)other->size);
    size_t to = any((uint32_t)running_size);
    size_t bytes = 1 + any(16);
    bytes = bytes < other->size - from ? bytes : other->size - from;
    bytes = bytes < longest - to ? bytes : longest - to;
    memcpy(running + to, other->data + from, bytes);
    running_size = to + bytes > running_size ? to + bytes : running_size;
}

static void take_out(void) {
    size_t at = any((uint32_t)running_size);
    size_t bytes = 1 + any(4);
    if (at + bytes < running_size) {
        memmove(running + at, running + at + bytes, running_size - at - bytes);
        running_size -= bytes;
    }
}

static void change(void) {
    size_t at = any((uint32_t)running_size);
    switch (any(6)) {
    case 0:
        running[at] ^= (uint8_t)(1u << any(8));
        break;
    case 1:
        running[at] = (uint8_t)any(256);
        break;
    case 2:
        running[at] = (uint8_t)(running[at] + any(9) - 4);
        break;
    case 3:
        take_out();
        break;
    default:
        splice();
    }
}

static void run_one(void) {
    const struct input *input = &inputs[any((uint32_t)count)];
    memcpy(running, input->data, input->size);
    running_size = input->size;
    for (uint32_t i = 1 + any(CHANGES_MAX); i; i--) {
        change();
    }
    LLVMFuzzerTestOneInput(running, running_size);
}

static void load_all(const char *list) {
    char name[4096];
    FILE *file = fopen(list, "r");
    while (file && fgets(name, sizeof name, file) && count < INPUTS_MAX) {
        name[strcspn(name, "\n")] = 0;
        load(name);
    }
    if (!count) {
        fprintf(stderr, "%s: no inputs\n", list);
        exit(2);
    }
    fclose(file);
}

int main(int words, char **word) {
    if (words != 6) {
        fprintf(stderr, "usage: %s LIST KEPT TIMES SEED LONGEST\n", word[0]);
        return 2;
    }
    mallopt(M_MMAP_THRESHOLD, LARGE);
    kept = word[2];
    state = strtoull(word[4], NULL, 10) * 2654435769u + 1u;
    longest = strtoull(word[5], NULL, 10);
    longest = longest < LONGEST ? longest : LONGEST;
    load_all(word[1]);
    signal(SIGABRT, on_signal);
#if __has_feature(address_sanitizer)
    __sanitizer_set_death_callback(keep);
#else
    signal(SIGSEGV, on_signal);
    signal(SIGFPE, on_signal);
#endif
    uint64_t times = strtoull(word[3], NULL, 10), done = 0;
    for (; done < times; done++) {
        run_one();
    }
    printf("executions %llu\n", (unsigned long long)done);
    return 0;
}
