/* Without a fuzzer: run each input of a list of files, one name a line. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LONGEST (1 << 20)

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void replay(const char *name) {
    FILE *file = fopen(name, "rb");
    if (!file) {
        fprintf(stderr, "%s: cannot be read\n", name);
        exit(1);
    }
    uint8_t *data = malloc(LONGEST);
    size_t size = fread(data, 1, LONGEST, file);
    fclose(file);
    uint8_t *input = malloc(size ? size : 1);
    memcpy(input, data, size);
    free(data);
    LLVMFuzzerTestOneInput(input, size);
    free(input);
}

int main(int count, char **words) {
    char name[4096];
    FILE *list = count == 2 ? fopen(words[1], "r") : NULL;
    if (!list) {
        fprintf(stderr, "usage: %s LIST\n", words[0]);
        return 1;
    }
    while (fgets(name, sizeof name, list)) {
        name[strcspn(name, "\n")] = 0;
        replay(name);
    }
    fclose(list);
    return 0;
}
