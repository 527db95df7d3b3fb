/* Change a model file at random, COUNT times: fuzz MODEL COUNT. Each is refused in words, or answers finite numbers. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "palpate.h"

static uint32_t state = 2463534242u;

static uint32_t next(void) {
    state ^= state << 13;
    state ^= state >> 17;
    state ^= state << 5;
    return state;
}

static void put(unsigned char *at, uint32_t value) {
    for (int i = 0; i < 4; i++) at[i] = (unsigned char)(value >> 8 * i);
}

static uint32_t checksum(const unsigned char *bytes, size_t count) {
    static uint32_t table[256];
    uint32_t crc = 0xffffffffu;
    for (uint32_t i = 0; !table[255] && i < 256; i++) {
        table[i] = i;
        for (int k = 0; k < 8; k++) table[i] = table[i] & 1u ? (table[i] >> 1) ^ 0xedb88320u : table[i] >> 1;
    }
    for (size_t i = 0; i < count; i++) crc = (crc >> 8) ^ table[(crc ^ bytes[i]) & 255u];
    return crc ^ 0xffffffffu;
}

/* a bit, a byte, a length, a number, the end; the checksum and the length are put right in seven of eight */
static size_t mutate(unsigned char *bytes, size_t count) {
    for (uint32_t k = 1 + next() % 3; k > 0; k--) {
        const size_t at = next() % count, word = 4 * (next() % (count / 4));
        switch (next() % 6) {
            case 0: bytes[at] ^= (unsigned char)(1u << next() % 8); break;
            case 1: bytes[at] = (unsigned char)next(); break;
            case 2: put(bytes + 20 + 4 * (next() % 7), next() % 2 ? next() : next() % 64); break;
            case 3: put(bytes + word, next() % 2 ? 0x7f000000u + next() % 0x01000000u : next()); break;
            case 4: put(bytes + word, next() % 2 ? 0xffffffffu : next() % 512); break;
            default: if (next() % 4 == 0) count = 1 + next() % count;
        }
        if (count < 64) return count;
    }
    if (next() % 8) put(bytes + 12, (uint32_t)count), put(bytes + 16, checksum(bytes + 20, count - 20));
    return count;
}

int main(int many, char **names) {
    FILE *file = many > 2 ? fopen(names[1], "rb") : NULL;
    static unsigned char whole[1 << 20];
    const size_t size = file ? fread(whole, 1, sizeof whole, file) : 0;
    long refused = 0, answered = 0;
    if (size < 256) return 2;
    fclose(file);
    for (long turn = 0; turn < atol(names[2]); turn++) {
        unsigned char *bytes = malloc(size), *exact;
        char why[160] = "";
        if (!bytes) return 2;
        memcpy(bytes, whole, size);
        const size_t count = mutate(bytes, size);
        exact = malloc(count);
        if (!exact) return 2;
        memcpy(exact, bytes, count);
        palpate_model *model = palpate_load(exact, count, why);
        free(exact);
        free(bytes);
        if (!model) {
            if (!why[0]) return fprintf(stderr, "refused without a word\n"), 1;
            refused++;
            continue;
        }
        const float *positions;
        const uint32_t n = palpate_nodes(model, &positions);
        float *moved = calloc(3 * (size_t)n, sizeof *moved);
        const double weights[3] = {0.5, 0.25, 0.25};
        palpate_press presses[2] = {{next() % 8, {0.5, 0.25, 0.25}, 0, {0.01, -0.02, -0.2}}, {next() % 8, {0, 0, 1}, turn % 2, {0.001, 0, -0.002}}};
        double forces[6] = {0};
        palpate_answer answer = {0, ""};
        if (!moved || weights[0] < 0) return 2;
        for (int go_on = 0; go_on < 2; go_on++) {
            if (palpate_respond(model, presses, 2, go_on, moved, forces, &answer)) continue;
            int finite = isfinite(answer.error) && answer.error >= 0;
            for (size_t i = 0; i < 3 * (size_t)n; i++) finite = finite && isfinite(moved[i]);
            for (int i = 0; i < 6; i++) finite = finite && isfinite(forces[i]);
            if (!finite) return fprintf(stderr, "an answer is not finite, turn %ld\n", turn), 1;
            answered += 1 - go_on;
        }
        const palpate_place *places;
        const double ways[2][3] = {{0, 0, -1}, {0.4, 0.1, -1}};
        for (uint32_t k = 0; k < palpate_places(model, &places) && k < 2; k++) {
            palpate_touched touched;
            if (palpate_touch(model, k, fmin(0.8 * places[k].deepest, 1), turn % 3 ? ways[turn % 2] : NULL, moved, &touched)) continue;
            int finite = isfinite(touched.error) && isfinite(touched.along) && isfinite(touched.area);
            for (size_t i = 0; i < 3 * (size_t)n; i++) finite = finite && isfinite(moved[i]);
            if (!finite) return fprintf(stderr, "a touch is not finite, turn %ld\n", turn), 1;
        }
        free(moved);
        palpate_free(model);
    }
    printf("%ld %ld\n", refused, answered);
    return 0;
}
