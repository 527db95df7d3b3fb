/* Answer presses from a file of numbers: ask MODEL PRESSES ANSWERS, all binary. With a fourth argument, its times too. */
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "palpate.h"

static unsigned char *whole(const char *path, size_t *count) {
    FILE *file = fopen(path, "rb");
    unsigned char *bytes;
    if (!file) exit(2);
    fseek(file, 0, SEEK_END);
    *count = (size_t)ftell(file);
    rewind(file);
    bytes = malloc(*count + 1);
    if (!bytes || fread(bytes, 1, *count, file) != *count) exit(2);
    fclose(file);
    return bytes;
}

int main(int many, char **names) {
    size_t count, size;
    char why[160];
    const float *positions;
    if (many < 4) return 2;
    unsigned char *bytes = whole(names[1], &count);
    palpate_model *model = palpate_load(bytes, count, why);
    free(bytes);
    if (!model) return fprintf(stderr, "%s\n", why), 1;
    /* a load: how many presses, below 0 if it goes on from the last; then triangle, weights, whether it moves, three numbers */
    double *asked = (double *)(void *)whole(names[2], &size);
    FILE *out = fopen(names[3], "wb");
    const uint32_t n = palpate_nodes(model, &positions);
    float *moved = malloc(3 * (size_t)n * sizeof *moved);
    if (!out || !moved) return 2;
    for (size_t at = 0; at < size / sizeof *asked;) {
        palpate_press presses[16];
        palpate_answer answer;
        double forces[48];
        const int go_on = asked[at] < 0;
        const size_t presses_count = (size_t)(go_on ? -asked[at] : asked[at]);
        at++;
        for (size_t k = 0; k < presses_count; k++, at += 8) {
            presses[k].triangle = (uint32_t)asked[at];
            presses[k].moves = asked[at + 4] != 0;
            for (int d = 0; d < 3; d++) presses[k].weights[d] = asked[at + 1 + d], presses[k].given[d] = asked[at + 5 + d];
        }
        struct timespec begin, end;
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &begin);
        if (palpate_respond(model, presses, presses_count, go_on, moved, forces, &answer)) return fprintf(stderr, "%s\n", answer.doubt), 1;
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &end);
        const double told[3] = {answer.error, answer.doubt[0] != 0,
                                1e3 * (double)(end.tv_sec - begin.tv_sec) + 1e-6 * (double)(end.tv_nsec - begin.tv_nsec)};
        fwrite(told, sizeof *told, 3, out);
        fwrite(forces, sizeof *forces, 3 * presses_count, out);
        fwrite(moved, sizeof *moved, 3 * (size_t)n, out);
        fwrite(answer.doubt, 1, 160, out);
    }
    fclose(out);
    free(asked);
    free(moved);
    palpate_free(model);
    return 0;
}
