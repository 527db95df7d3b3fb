/* Answer touches from a file of numbers: ask_touch MODEL TOUCHES ANSWERS, all binary; six numbers a touch: its place, its
   depth, whether it has a direction, and that. With a second line of numbers, the processor time of each [ms]. */
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "palpate.h"

int main(int many, char **names) {
    static unsigned char whole[1 << 24];
    char why[160];
    const float *positions;
    const palpate_place *places;
    double row[6];
    FILE *file = many > 3 ? fopen(names[1], "rb") : NULL, *asked = file ? fopen(names[2], "rb") : NULL, *out = asked ? fopen(names[3], "wb") : NULL;
    if (!out) return 2;
    palpate_model *model = palpate_load(whole, fread(whole, 1, sizeof whole, file), why);
    if (!model) return fprintf(stderr, "%s\n", why), 1;
    const uint32_t n = palpate_nodes(model, &positions), count = palpate_places(model, &places);
    float *moved = malloc(3 * (size_t)n * sizeof *moved);
    if (!moved) return 2;
    while (fread(row, sizeof *row, 6, asked) == 6) {
        palpate_touched answer;
        struct timespec begin, end;
        if (!((uint32_t)row[0] < count)) return 2;
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &begin);
        if (palpate_touch(model, (uint32_t)row[0], row[1], row[2] != 0 ? row + 3 : NULL, moved, &answer)) return fprintf(stderr, "%s\n", answer.doubt), 1;
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &end);
        const double told[10] = {answer.force[0], answer.force[1], answer.force[2], answer.along, answer.area, answer.tip[0], answer.tip[1],
            answer.tip[2], answer.force_error, 1e3 * (double)(end.tv_sec - begin.tv_sec) + 1e-6 * (double)(end.tv_nsec - begin.tv_nsec)};
        fwrite(told, sizeof *told, 10, out);
        fwrite(moved, sizeof *moved, 3 * (size_t)n, out);
        fwrite(answer.doubt, 1, 160, out);
    }
    fclose(out);
    free(moved);
    palpate_free(model);
    return 0;
}
