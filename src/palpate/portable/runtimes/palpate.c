/* Answer presses on a body from a portable model file; see palpate.h. */
#include "palpate.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define VERSION 1u
#define HEAD 144u
#define ENOUGH 1e-6
#define CLOSE 1e-6
#define HELD 2e-3
enum { ITERATIONS = 200, MEMORY = 10, MOST = 40 };
enum { MOST_MODES = 256, MOST_CELLS = 4096, MOST_VECTORS = 1024, MOST_PARTS = 8, MOST_PRESSES = 16 };

typedef struct {
    uint32_t r, m; double place[3], normal[3], bearing[3], reach, noise;
    double *loads, *rest, *volumes, *mu, *lam, *slopes, *coefficients, *here, *f;
} contact;

typedef struct {
    contact *one; double weight, loads[3 * MOST_MODES], q[MOST_MODES]; int warm;
} neighbour;

typedef struct {
    double *disc, apart, *more, size, spread, least, far, left; neighbour near[3]; int count;
} place_of_press;

struct palpate_model {
    void *held; uint32_t n, t, stored, vectors, contacts_count, parts; double s[12]; char *info;
    float *nodes, *normals, *by, *basis, *compliance, *moved; uint32_t *triangles, *from;
    double *shapes, *areas, *facing, *middles, *weights, wide, *part, *sum, *loaded; uint32_t shapes_count;
    contact *contacts; place_of_press places[MOST_PRESSES];
};

typedef struct {
    palpate_model *model; const unsigned char *bytes; size_t count, at; const char *why;
} reader;

static uint32_t word(const unsigned char *p) {
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}
static double dot(const double *a, const double *b, size_t count) {
    double sum = 0;
    for (size_t i = 0; i < count; i++) sum += a[i] * b[i];
    return sum;
}
static uint32_t crc32_of(const unsigned char *bytes, size_t count) {
    uint32_t table[256], crc = 0xffffffffu;
    for (uint32_t i = 0; i < 256; i++) {
        uint32_t c = i;
        for (int k = 0; k < 8; k++) c = c & 1u ? (c >> 1) ^ 0xedb88320u : c >> 1;
        table[i] = c;
    }
    for (size_t i = 0; i < count; i++) crc = table[(crc ^ bytes[i]) & 255u] ^ (crc >> 8);
    return crc ^ 0xffffffffu;
}
/* memory of zeros that lives as long as the model */
static void *keep(reader *in, size_t count, size_t size) {
    void **found = calloc(1, 2 * sizeof(double) + (count ? count : 1) * size);
    if (!found) return in->why = "there is no memory for it", NULL;
    found[0] = in->model->held; in->model->held = found;
    return (char *)found + 2 * sizeof(double);
}
/* the next count numbers of so many bytes each, or NULL; what follows begins at a multiple of four */
static const unsigned char *take(reader *in, size_t count, size_t size) {
    const unsigned char *found = in->bytes + in->at;
    if (in->why) return NULL;
    if (count > in->count || count * size > in->count - in->at) return in->why = "an array is longer than the file", NULL;
    for (in->at += count * size; in->at % 4 && in->at < in->count;) in->at++;
    return found;
}
static float single(reader *in, const unsigned char *p) {
    const uint32_t w = word(p); float found; memcpy(&found, &w, 4);
    if (!isfinite(found)) in->why = "a number is not finite";
    return found;
}
static float *floats(reader *in, size_t count) {
    const unsigned char *p = take(in, count, 4); float *found = p ? keep(in, count, sizeof *found) : NULL;
    for (size_t i = 0; found && i < count; i++) found[i] = single(in, p + 4 * i);
    return found;
}
static double *doubles(reader *in, size_t count) {
    const unsigned char *p = take(in, count, 4); double *found = p ? keep(in, count, sizeof *found) : NULL;
    for (size_t i = 0; found && i < count; i++) found[i] = single(in, p + 4 * i);
    return found;
}
static uint32_t *numbers(reader *in, size_t count, uint32_t below, const char *otherwise) {
    const unsigned char *p = take(in, count, 4); uint32_t *found = p ? keep(in, count, sizeof *found) : NULL;
    for (size_t i = 0; found && i < count; i++)
        if ((found[i] = word(p + 4 * i)) >= below) in->why = otherwise;
    return found;
}
/* the next count 16-bit numbers times the scale of their column, or of their row, in rows of so many */
static double *scaled(reader *in, size_t rows, size_t columns, int by_row) {
    double *scale = doubles(in, by_row ? rows : columns), *found;
    const unsigned char *p = take(in, rows * columns, 2);
    if (!p || !scale || !(found = keep(in, rows * columns, sizeof *found))) return NULL;
    for (size_t i = 0; i < rows * columns; i++)
        found[i] = (int16_t)(uint16_t)(p[2 * i] | p[2 * i + 1] << 8) * scale[by_row ? i / columns : i % columns];
    return found;
}
static void add(palpate_model *m, uint32_t node, double weight) {
    for (uint32_t i = 6 * node; i < 6 * node + 6; i++) m->weights[m->from[i]] += weight * m->by[i];
}
/* the mean of the vectors over the disc around a point, (3, vectors), weighted by its pressure */
static void mean_over_disc(palpate_model *m, const double *point, const double *normal, double *found) {
    const double square = m->s[0] * m->s[0], near = (m->s[0] + m->wide) * (m->s[0] + m->wide); double total = 0;
    memset(m->weights, 0, m->stored * sizeof *m->weights);
    for (uint32_t e = 0; e < m->t; e++) {
        double apart = 0, cosine = 0, x[9], sums[3] = {0, 0, 0};
        for (int d = 0; d < 3; d++) {
            apart += (m->middles[3 * e + d] - point[d]) * (m->middles[3 * e + d] - point[d]);
            cosine += m->facing[3 * e + d] * normal[d];
        }
        if (apart >= near || !(cosine > 0)) continue;
        const double weight = fmin(cosine / 0.1, 1) * m->areas[e];
        for (int k = 0; k < 9; k++) x[k] = (double)m->nodes[3 * m->triangles[3 * e + k / 3] + k % 3] - point[k % 3];
        for (uint32_t i = 0; i < m->shapes_count; i++) {
            const double *w = m->shapes + 3 * i; double part = 1;
            for (int d = 0; d < 3; d++) {
                const double off = w[0] * x[d] + w[1] * x[3 + d] + w[2] * x[6 + d]; part -= off * off / square;
            }
            for (int k = 0; part > 0 && k < 3; k++) sums[k] += w[k] * part;
        }
        for (int k = 0; k < 3; k++) add(m, m->triangles[3 * e + k], weight * sums[k]);
        total += weight * (sums[0] + sums[1] + sums[2]);
    }
    if (!(total > 0)) {
        uint32_t best = 0; double least = INFINITY;
        for (uint32_t i = 0; i < m->n; i++) {
            double apart = 0;
            for (int d = 0; d < 3; d++) apart += (m->nodes[3 * i + d] - point[d]) * (m->nodes[3 * i + d] - point[d]);
            if (apart < least) best = i, least = apart;
        }
        memset(m->weights, 0, m->stored * sizeof *m->weights); add(m, best, 1); total = 1;
    }
    memset(found, 0, 3 * m->vectors * sizeof *found);
    for (uint32_t i = 0; i < m->stored; i++) {
        const double weight = m->weights[i] / total;
        if (weight == 0) continue;
        for (uint32_t d = 0; d < 3; d++) {
            const float *row = m->basis + (size_t)(3 * i + d) * m->vectors;
            for (uint32_t v = 0; v < m->vectors; v++) found[d * m->vectors + v] += weight * row[v];
        }
    }
}

static void read_contact(palpate_model *model, reader *in, contact *one) {
    const unsigned char *p = take(in, 2, 4); const size_t b = model->vectors;
    if (!p) return;
    const size_t r = one->r = word(p), m = one->m = word(p + 4);
    if (r == 0 || r > MOST_MODES || m > MOST_CELLS) in->why = "a contact has too many coordinates or cells";
    const double *places = doubles(in, 10); one->loads = doubles(in, 3 * r); one->rest = doubles(in, r * r);
    one->volumes = doubles(in, m); one->mu = doubles(in, m); one->lam = doubles(in, m);
    one->slopes = scaled(in, 9 * m, r, 0); one->coefficients = scaled(in, r, b, 1);
    if (in->why) return;
    one->here = keep(in, 3 * b, sizeof(double)); one->f = keep(in, 9 * m, sizeof(double));
    one->reach = places[9];
    if (!(one->reach > 0)) in->why = "a contact reaches nowhere";
    for (int d = 0; d < 3; d++) one->place[d] = places[d], one->normal[d] = places[3 + d], one->bearing[d] = places[6 + d];
    for (size_t i = 0; i < m; i++) one->noise += 4e-15 * one->volumes[i] * (one->mu[i] + one->lam[i]);
    if (!in->why) mean_over_disc(model, one->place, one->normal, one->here);
}

static void split_triangle(palpate_model *m) {
    const uint32_t count = m->parts; double *at = m->shapes;
    for (uint32_t i = 0; i < count; i++)
        for (uint32_t j = 0; j < count - i; j++)
            for (uint32_t k = 1; k < (i + j + 1 < count ? 3u : 2u); k++, at += 3, m->shapes_count++) {
                at[0] = (3.0 * i + k) / (3.0 * count); at[1] = (3.0 * j + k) / (3.0 * count);
                at[2] = 1 - at[0] - at[1];
            }
}
/* areas, normals and middles of the triangles */
static void frame(palpate_model *m) {
    for (uint32_t e = 0; e < m->t; e++) {
        const float *a = m->nodes + 3 * m->triangles[3 * e], *b = m->nodes + 3 * m->triangles[3 * e + 1];
        const float *corners[3] = {a, b, m->nodes + 3 * m->triangles[3 * e + 2]};
        double p[3], q[3], *area = m->facing + 3 * e;
        for (int d = 0; d < 3; d++) {
            p[d] = (double)b[d] - a[d]; q[d] = (double)corners[2][d] - a[d];
            m->middles[3 * e + d] = ((double)a[d] + b[d] + corners[2][d]) / 3;
        }
        for (int d = 0; d < 3; d++) area[d] = p[(d + 1) % 3] * q[(d + 2) % 3] - p[(d + 2) % 3] * q[(d + 1) % 3];
        m->areas[e] = sqrt(dot(area, area, 3));
        for (int d = 0; d < 3; d++) area[d] /= fmax(m->areas[e], 1e-300);
        for (int k = 0; k < 3; k++) {
            double square = 0;
            for (int d = 0; d < 3; d++) square += (corners[k][d] - m->middles[3 * e + d]) * (corners[k][d] - m->middles[3 * e + d]);
            m->wide = fmax(m->wide, sqrt(square));
        }
    }
}

static void read_surface(palpate_model *m, reader *in) {
    const size_t n = m->n, t = m->t, b = m->vectors, rows = 3 * (size_t)m->stored; m->nodes = floats(in, 3 * n);
    m->normals = floats(in, 3 * n);
    m->triangles = numbers(in, 3 * t, m->n, "a triangle has a node that is not there");
    m->from = numbers(in, 6 * n, m->stored, "a node is made of one that is not there");
    m->by = floats(in, 6 * n); const double *basis = scaled(in, b, rows, 1); m->compliance = floats(in, b * b);
    if (in->why) return;
    m->basis = keep(in, rows * b, sizeof(float));
    for (size_t i = 0; m->basis && i < rows * b; i++) m->basis[i] = (float)basis[i % b * rows + i / b];
    m->shapes = keep(in, 3 * (size_t)m->parts * m->parts, sizeof(double));
    m->areas = keep(in, t, sizeof(double)); m->facing = keep(in, 3 * t, sizeof(double));
    m->middles = keep(in, 3 * t, sizeof(double)); m->weights = keep(in, m->stored, sizeof(double));
    m->moved = keep(in, rows, sizeof(float)); m->part = keep(in, 3 * b, sizeof(double));
    m->sum = keep(in, b, sizeof(double)); m->loaded = keep(in, b, sizeof(double));
    m->contacts = keep(in, m->contacts_count, sizeof(contact));
    for (uint32_t i = 0; i < MOST_PRESSES; i++) {
        m->places[i].disc = keep(in, 3 * b, sizeof(double)); m->places[i].more = keep(in, b, sizeof(double));
    }
    if (in->why) return;
    split_triangle(m); frame(m);
}
/* what is before the arrays; returns the length of the header's text */
static size_t read_head(palpate_model *m, reader *in) {
    const unsigned char *p = in->bytes; const size_t count = in->count;
    if (count < HEAD || memcmp(p, "palpate\n", 8) != 0) return in->why = "this is no portable model of palpate", 0;
    if (word(p + 8) != VERSION) return in->why = "this is a portable model of another version than 1, which is read here", 0;
    if (word(p + 12) != count) return in->why = "the file was cut off, or more was added: its size is not the one it says", 0;
    if (word(p + 16) != crc32_of(p + 20, count - 20)) return in->why = "the checksum is wrong; the file is damaged", 0;
    m->n = word(p + 24), m->t = word(p + 28), m->stored = word(p + 32);
    m->vectors = word(p + 36), m->contacts_count = word(p + 40), m->parts = word(p + 44);
    const int sound = m->n > 0 && m->n <= count && m->t > 0 && m->t <= count && m->stored > 0 && m->stored <= m->n;
    if (!sound || m->vectors == 0 || m->vectors > MOST_VECTORS || m->contacts_count == 0 || m->contacts_count > count / 48 ||
        m->parts == 0 || m->parts > MOST_PARTS)
        return in->why = "its sizes are not those of a model", 0;
    for (int i = 0; i < 12; i++) {
        const uint64_t bits = (uint64_t)word(p + 52 + 8 * i) << 32 | word(p + 48 + 8 * i);
        memcpy(m->s + i, &bits, 8);
        if (!isfinite(m->s[i]) || m->s[i] < 0) in->why = "a number of the header is not finite";
    }
    if (!in->why && !(m->s[0] > 0)) in->why = "the radius is not above 0";
    if (!in->why && (word(p + 20) % 4 || word(p + 20) > count - HEAD)) in->why = "its header is longer than the file";
    return word(p + 20);
}

palpate_model *palpate_load(const void *bytes, size_t count, char why[160]) {
    palpate_model *m = calloc(1, sizeof *m);
    reader in = {m, bytes, count, HEAD, m ? NULL : "there is no memory for it"};
    const size_t words = m ? read_head(m, &in) : 0;
    if (!in.why && (m->info = keep(&in, words + 1, 1))) memcpy(m->info, in.bytes + HEAD, words);
    if (!in.why) in.at += words, read_surface(m, &in);
    for (uint32_t i = 0; !in.why && i < m->contacts_count; i++) read_contact(m, &in, m->contacts + i);
    if (!in.why && in.at != count) in.why = "something follows its last array";
    if (!in.why) return m;
    snprintf(why, 160, "%s", in.why); palpate_free(m);
    return NULL;
}

void palpate_free(palpate_model *m) {
    for (void **each = m ? m->held : NULL, **next; each; each = next) next = each[0], free(each);
    free(m);
}

uint32_t palpate_nodes(const palpate_model *m, const float **positions) { return *positions = m->nodes, m->n; }
uint32_t palpate_triangles(const palpate_model *m, const uint32_t **corners) { return *corners = m->triangles, m->t; }
const char *palpate_info(const palpate_model *m) { return m->info; }

/* energy of a contact's cells less the work of the load; writes the gradient (r) and the smallest det F.
   s = tr R'F is the largest root of (s^2 - I)^2 = 4 II + 8 J s, I, II and J^2 being the invariants of F'F; R = ds/dF */
static double evaluate(contact *one, const double *load, const double *q, double *gradient, double *least) {
    const size_t r = one->r, m = one->m; double energy = 0, *f = one->f; *least = INFINITY;
    for (size_t i = 0; i < 9 * m; i++) f[i] = dot(one->slopes + i * r, q, r);
    for (size_t k = 0; k < m; k++) {
        double F[9], C[9], G[9], S[9], first = 0, second = 0;
        for (int i = 0; i < 9; i++) F[i] = f[i * m + k] + (i % 4 == 0);
        C[0] = F[4] * F[8] - F[5] * F[7], C[1] = F[5] * F[6] - F[3] * F[8], C[2] = F[3] * F[7] - F[4] * F[6];
        C[3] = F[2] * F[7] - F[1] * F[8], C[4] = F[0] * F[8] - F[2] * F[6], C[5] = F[1] * F[6] - F[0] * F[7];
        C[6] = F[1] * F[5] - F[2] * F[4], C[7] = F[2] * F[3] - F[0] * F[5], C[8] = F[0] * F[4] - F[1] * F[3];
        for (int i = 0; i < 9; i++) first += F[i] * F[i], second += C[i] * C[i];
        const double det = F[0] * C[0] + F[1] * C[1] + F[2] * C[2]; double s = sqrt(3 * first);
        for (int turn = 0; turn < 30; turn++) {
            const double off = s * s - first;
            const double change = (off * off - 4 * second - 8 * det * s) / fmax(4 * s * off - 8 * det, 1e-12);
            s -= change;
            if (!(fabs(change) > 1e-13 * s)) break;
        }
        const double off = s * s - first, mu = one->mu[k], lam = one->lam[k], volume = one->volumes[k];
        energy += volume * (mu * (first - 2 * s + 3) + 0.5 * lam * (s - 3) * (s - 3));
        const double bottom = fmax(s * off - 2 * det, 1e-12), turned = (lam * (s - 3) - 2 * mu) * volume / bottom;
        const double own = 2 * mu * volume + turned * (off + 2 * first);
        for (int i = 0; i < 9; i++) G[i] = F[i / 3] * F[i % 3] + F[3 + i / 3] * F[3 + i % 3] + F[6 + i / 3] * F[6 + i % 3];
        for (int i = 0; i < 9; i++) S[i] = F[i / 3 * 3] * G[i % 3] + F[i / 3 * 3 + 1] * G[3 + i % 3] + F[i / 3 * 3 + 2] * G[6 + i % 3];
        for (int i = 0; i < 9; i++) f[i * m + k] = own * F[i] - 2 * turned * S[i] + 2 * s * turned * C[i];
        if (!(det >= *least)) *least = det;
    }
    for (size_t i = 0; i < r; i++) {
        const double pull = dot(one->rest + i * r, q, r); energy += q[i] * (0.5 * pull - load[i]);
        gradient[i] = pull - load[i];
    }
    for (size_t i = 0; i < 9 * m; i++)
        for (size_t k = 0; k < r; k++) gradient[k] += f[i] * one->slopes[i * r + k];
    return energy;
}
/* minimise it from q on, by L-BFGS that starts from the identity; returns the residual over the load */
static double settle(contact *one, const double *load, double *q, double *least) {
    double steps[MEMORY][MOST_MODES], bends[MEMORY][MOST_MODES], scale[MEMORY], part[MEMORY];
    double gradient[MOST_MODES], bent[MOST_MODES], ahead[MOST_MODES], reached[MOST_MODES], lower = 0, smallest = 0;
    const size_t r = one->r; const double size = sqrt(dot(load, load, r));
    double energy = evaluate(one, load, q, gradient, least); int kept = 0;
    for (int turn = 0; turn < ITERATIONS; turn++) {
        if (sqrt(dot(gradient, gradient, r)) <= ENOUGH * size) break;
        const int oldest = kept > MEMORY ? kept - MEMORY : 0;
        for (size_t i = 0; i < r; i++) ahead[i] = -gradient[i];
        for (int j = kept - 1; j >= oldest; j--) {
            const int k = j % MEMORY; part[k] = scale[k] * dot(steps[k], ahead, r);
            for (size_t i = 0; i < r; i++) ahead[i] -= part[k] * bends[k][i];
        }
        for (int j = oldest; j < kept; j++) {
            const int k = j % MEMORY; const double by = part[k] - scale[k] * dot(bends[k], ahead, r);
            for (size_t i = 0; i < r; i++) ahead[i] += by * steps[k][i];
        }
        const double slope = -dot(gradient, ahead, r); double length = 1; int found = 0;
        while (slope > 0 && length > 1e-4) {
            for (size_t i = 0; i < r; i++) reached[i] = q[i] + length * ahead[i];
            lower = evaluate(one, load, reached, bent, &smallest);
            if ((found = lower <= energy - 1e-4 * length * slope + 1e-12 * fabs(energy) + one->noise)) break;
            length *= 0.5;
        }
        if (!found) {
            if (kept == 0) break;
            kept = 0;
            continue;
        }
        const int k = kept % MEMORY;
        for (size_t i = 0; i < r; i++) {
            steps[k][i] = reached[i] - q[i]; bends[k][i] = bent[i] - gradient[i];
        }
        const double curvature = dot(steps[k], bends[k], r);
        if (curvature > 0) scale[k] = 1 / curvature, kept++;
        memcpy(q, reached, r * sizeof *q); memcpy(gradient, bent, r * sizeof *gradient);
        energy = lower, *least = smallest;
    }
    return sqrt(dot(gradient, gradient, r)) / fmax(size, 1e-300);
}
/* what a press needs, at its point of the surface; 0, or -1 with a sentence */
static int find_place(palpate_model *m, const palpate_press *press, place_of_press *at, char *why) {
    double point[3] = {0, 0, 0}, normal[3] = {0, 0, 0}, apart[4] = {INFINITY, INFINITY, INFINITY, INFINITY}, shares[3], total = 0;
    contact *order[4] = {NULL, NULL, NULL, NULL};
    const double *w = press->weights; const char *wrong = NULL;
    if (press->triangle >= m->t) wrong = "the press is on a triangle which is not there";
    else if (!(fabs(w[0] + w[1] + w[2] - 1) < 1e-4 && w[0] >= -1e-6 && w[1] >= -1e-6 && w[2] >= -1e-6))
        wrong = "the weights of a press are not of a point in its triangle";
    else if (!isfinite(press->given[0]) || !isfinite(press->given[1]) || !isfinite(press->given[2]))
        wrong = "a press needs three finite numbers as its force";
    if (wrong) return snprintf(why, 160, "%s", wrong), -1;
    for (int k = 0; k < 9; k++) {
        const size_t node = 3 * (size_t)m->triangles[3 * press->triangle + k / 3] + k % 3;
        point[k % 3] += w[k / 3] * m->nodes[node]; normal[k % 3] += w[k / 3] * m->normals[node];
    }
    const double length = fmax(sqrt(dot(normal, normal, 3)), 1e-30);
    for (int d = 0; d < 3; d++) normal[d] /= length;
    mean_over_disc(m, point, normal, at->disc);
    for (uint32_t i = 0; i < m->contacts_count; i++) {
        contact *one = m->contacts + i; double square = 0;
        for (int d = 0; d < 3; d++) {
            const double off = one->place[d] - point[d], turn = m->s[0] * (one->normal[d] - normal[d]);
            square += off * off + turn * turn;
        }
        const double far = sqrt(square); int k = 4;
        while (k > 0 && far < apart[k - 1]) k--;
        for (int j = 3; j > k; j--) apart[j] = apart[j - 1], order[j] = order[j - 1];
        if (k < 4) apart[k] = far, order[k] = one;
    }
    const double edge = order[3] ? fmax(apart[3], 1e-9) : INFINITY;
    for (int k = 0; k < 3; k++) {
        const double off = fmax(apart[k], 1e-9), left = order[k] ? fmax(0, 1 - off / edge) : 0;
        total += shares[k] = left > 0 ? left * left / (off * off) : 0;
    }
    if (!(total > 0)) total = shares[0] = 1, shares[1] = shares[2] = 0;
    at->count = 0, at->apart = apart[0];
    for (int k = 0; k < 3 && order[k]; k++) {
        neighbour *near = at->near + at->count;
        if (!(shares[k] > 1e-3 * total)) continue;
        contact *one = near->one = order[k]; near->weight = shares[k], near->warm = 0, at->count++;
        for (uint32_t i = 0; i < 3 * m->vectors; i++) m->part[i] = at->disc[i] - one->here[i];
        for (uint32_t i = 0; i < 3 * one->r; i++)
            near->loads[i] = one->loads[i] + dot(m->part + i % 3 * m->vectors, one->coefficients + (size_t)(i / 3) * m->vectors, m->vectors);
    }
    total = 0;
    for (int k = 0; k < at->count; k++) total += at->near[k].weight;
    for (int k = 0; k < at->count; k++) at->near[k].weight /= total;
    return 0;
}
/* what a press has beyond its linear part */
static void bend(palpate_model *m, place_of_press *at, const double *force, int warm) {
    const size_t b = m->vectors; double load[MOST_MODES], least = 0; memset(at->more, 0, b * sizeof *at->more);
    at->least = INFINITY, at->far = at->left = at->spread = 0;
    for (int k = 0; k < at->count; k++) {
        neighbour *near = at->near + k; contact *one = near->one; double *part = m->part + k * b;
        for (uint32_t i = 0; i < one->r; i++) load[i] = dot(near->loads + 3 * i, force, 3);
        if (!warm || !near->warm) memcpy(near->q, load, one->r * sizeof *load);
        near->warm = 1; at->left = fmax(at->left, settle(one, load, near->q, &least));
        at->least = fmin(at->least, least);
        at->far = fmax(at->far, sqrt(dot(near->q, near->q, one->r)) / one->reach);
        memset(part, 0, b * sizeof *part);
        for (uint32_t i = 0; i < one->r; i++)
            for (size_t v = 0; v < b; v++) part[v] += (near->q[i] - load[i]) * one->coefficients[i * b + v];
        for (size_t v = 0; v < b; v++) at->more[v] += near->weight * part[v];
    }
    for (int k = 0; k < at->count; k++)
        for (size_t v = 0; v < b; v++) {
            const double off = m->part[k * b + v] - at->more[v]; at->spread += at->near[k].weight * off * off;
        }
    at->spread = sqrt(at->spread); at->size = sqrt(dot(at->more, at->more, b));
}
/* coordinates of all presses in the vectors, into m->sum */
static void all(palpate_model *m, size_t count, const double *forces, int warm) {
    const size_t b = m->vectors; memset(m->loaded, 0, b * sizeof *m->loaded);
    for (size_t k = 0; k < 3 * count; k++)
        for (size_t v = 0; v < b; v++) m->loaded[v] += forces[k] * m->places[k / 3].disc[k % 3 * b + v];
    for (size_t i = 0; i < b; i++) {
        m->sum[i] = 0;
        for (size_t j = 0; j < b; j++) m->sum[i] += m->compliance[i * b + j] * m->loaded[j];
    }
    for (size_t k = 0; k < count; k++) {
        bend(m, m->places + k, forces + 3 * k, warm);
        for (size_t v = 0; v < b; v++) m->sum[v] += m->places[k].more[v];
    }
}
/* Gauss and Jordan, with pivots, of rows of 2 size numbers; zeros where there is none */
static void invert(double *a, size_t size, double least) {
    const size_t wide = 2 * size;
    for (size_t i = 0; i < size; i++)
        for (size_t j = 0; j < size; j++) a[i * wide + size + j] = i == j;
    for (size_t k = 0; k < size; k++) {
        size_t best = k;
        for (size_t i = k + 1; i < size; i++)
            if (fabs(a[i * wide + k]) > fabs(a[best * wide + k])) best = i;
        const double pivot = a[best * wide + k];
        if (!(fabs(pivot) > least && isfinite(pivot))) {
            memset(a, 0, wide * size * sizeof *a);
            return;
        }
        for (size_t j = 0; j < wide; j++) {
            const double swap = a[k * wide + j]; a[k * wide + j] = a[best * wide + j];
            a[best * wide + j] = swap; a[k * wide + j] /= pivot;
        }
        for (size_t i = 0; i < size; i++)
            for (size_t j = wide; i != k && j-- > k;) a[i * wide + j] -= a[i * wide + k] * a[k * wide + j];
    }
}
static double largest(const double *x, size_t count) {
    double found = 0;
    for (size_t i = 0; i < count; i++)
        if (!(fabs(x[i]) <= found)) found = fabs(x[i]);
    return found;
}
/* by how much the moved discs miss what is asked of them */
static void missing(palpate_model *m, size_t count, const double *force, const double *given, const size_t *free_, size_t size, double *left) {
    all(m, count, force, 1);
    for (size_t i = 0; i < size; i++)
        left[i] = given[free_[i]] - dot(m->places[free_[i] / 3].disc + free_[i] % 3 * m->vectors, m->sum, m->vectors);
}
/* the inverse, right of what invert was given, times x */
static void times(const double *matrix, const double *x, size_t size, double *found) {
    for (size_t i = 0; i < size; i++) found[i] = dot(matrix + (2 * i + 1) * size, x, size);
}
/* find the forces of moved discs by Broyden's method; returns whether they were missed */
static int find_forces(palpate_model *m, const palpate_press *presses, size_t count, const double *given, double *force) {
    enum { WIDE = 3 * MOST_PRESSES };
    double inverse[2 * WIDE * WIDE], left[WIDE], now[WIDE], step[WIDE], tried[WIDE], change[WIDE], by[WIDE], scale = 0;
    size_t free_[WIDE], size = 0; const size_t b = m->vectors;
    for (size_t i = 0; i < 3 * count; i++) {
        force[i] = presses[i / 3].moves ? 0 : given[i];
        if (presses[i / 3].moves) free_[size++] = i, scale = fmax(scale, fabs(given[i]));
    }
    for (size_t i = 0; i < size; i++) {
        const double *mine = m->places[free_[i] / 3].disc + free_[i] % 3 * b;
        memset(m->loaded, 0, b * sizeof *m->loaded);
        for (size_t a = 0; a < b; a++)
            for (size_t c = 0; c < b; c++) m->loaded[c] += mine[a] * m->compliance[a * b + c];
        for (size_t j = 0; j < size; j++) inverse[2 * i * size + j] = dot(m->loaded, m->places[free_[j] / 3].disc + free_[j] % 3 * b, b);
    }
    invert(inverse, size, m->s[10] > 0 ? HELD * m->s[9] / m->s[10] : 0);
    missing(m, count, force, given, free_, size, left), times(inverse, left, size, step), scale = fmax(scale, largest(left, size));
    for (int turn = 0; turn < MOST; turn++) {
        if (largest(left, size) <= CLOSE * scale) return 0;
        memcpy(tried, force, 3 * count * sizeof *tried);
        for (size_t i = 0; i < size; i++) tried[free_[i]] += step[i];
        missing(m, count, tried, given, free_, size, now);
        if (!(sqrt(dot(now, now, size)) < 1.5 * sqrt(dot(left, left, size)))) {
            for (size_t i = 0; i < size; i++) step[i] *= 0.5;
            continue;
        }
        for (size_t i = 0; i < size; i++) left[i] -= now[i];
        times(inverse, left, size, change); const double below = dot(step, change, size);
        for (size_t j = 0; j < size; j++) {
            by[j] = 0;
            for (size_t i = 0; i < size; i++) by[j] += step[i] * inverse[(2 * i + 1) * size + j];
        }
        for (size_t i = 0; below != 0 && i < size * size; i++)
            inverse[(2 * (i / size) + 1) * size + i % size] += (step[i / size] - change[i / size]) * by[i % size] / below;
        memcpy(force, tried, 3 * count * sizeof *force); memcpy(left, now, size * sizeof *left);
        times(inverse, left, size, step);
    }
    return !(largest(left, size) <= 1e-3 * scale);
}

static void say_doubt(const palpate_model *m, const place_of_press *at, const double *force, char *doubt) {
    double hard = 0;
    for (int k = 0; k < at->count; k++) hard += at->near[k].weight * dot(at->near[k].one->bearing, force, 3);
    if (!(at->left <= 1e-3)) snprintf(doubt, 160, "the model found no rest: %.1f %% of the load are left", 100 * at->left);
    else if (!(at->least >= m->s[1])) snprintf(doubt, 160, "cells are squeezed to det F = %.2f, beyond what the contact's model was made for", at->least);
    else if (!(at->far <= m->s[2])) snprintf(doubt, 160, "this goes %.1f times as far as what the contact's model is made of", at->far);
    else if (!(hard <= m->s[3])) snprintf(doubt, 160, "this presses %.2f times as hard as finer elements are known to bear", hard);
    else if (!(at->apart <= m->s[4])) snprintf(doubt, 160, "the nearest place that was prepared is %.0f mm away", 1e3 * at->apart);
}
/* bring coordinates to all nodes; returns the largest displacement, or NAN */
static double expand(palpate_model *m, float *out) {
    const size_t b = m->vectors, rows = 3 * (size_t)m->stored; float *sum = m->moved + 0; double most = 0;
    int sound = 1;
    for (size_t v = 0; v < b; v++) sound = sound && isfinite((float)m->sum[v]);
    for (size_t i = 0; i < rows; i++) {
        const float *row = m->basis + i * b;
        float parts[8] = {0, 0, 0, 0, 0, 0, 0, 0}, one = 0;
        size_t v = 0;
        for (; v + 8 <= b; v += 8)
            for (size_t k = 0; k < 8; k++) parts[k] += row[v + k] * (float)m->sum[v + k];
        for (; v < b; v++) one += row[v] * (float)m->sum[v];
        for (size_t k = 0; k < 8; k++) one += parts[k];
        sum[i] = one;
    }
    for (size_t i = 0; i < m->n; i++) {
        double square = 0;
        for (size_t d = 0; d < 3; d++) {
            float one = 0;
            for (size_t j = 6 * i; j < 6 * i + 6; j++) one += m->by[j] * sum[3 * m->from[j] + d];
            sound = sound && isfinite(one); out[3 * i + d] = one; square += (double)one * one;
        }
        if (square > most) most = square;
    }
    return sound ? sqrt(most) : NAN;
}

int palpate_respond(palpate_model *m, const palpate_press *presses, size_t count, float *displacement, double *forces,
                    palpate_answer *answer) {
    double given[3 * MOST_PRESSES], sizes = 0, most = 0; int missed = 0, finite = 1, moves = 0;
    answer->doubt[0] = 0, answer->error = 1;
    if (count > MOST_PRESSES) return snprintf(answer->doubt, 160, "more than %d presses are asked for", MOST_PRESSES), -1;
    for (size_t k = 0; k < count; k++) {
        if (find_place(m, presses + k, m->places + k, answer->doubt)) return -1;
        memcpy(given + 3 * k, presses[k].given, sizeof presses[k].given); moves = moves || presses[k].moves;
    }
    memcpy(forces, given, 3 * count * sizeof *forces);
    if (moves) missed = find_forces(m, presses, count, given, forces);
    all(m, count, forces, 0); const double found = expand(m, displacement);
    for (size_t i = 0; i < 3 * count; i++) finite = finite && isfinite((float)forces[i]);
    if (!isfinite(found) || !finite) {
        memset(displacement, 0, 3 * (size_t)m->n * sizeof *displacement);
        memset(forces, 0, 3 * count * sizeof *forces);
        snprintf(answer->doubt, 160, "the numbers of this answer are beyond what can be stored");
        return 0;
    }
    const double peak = fmax(found, 1e-30); answer->error = m->s[5];
    if (missed) snprintf(answer->doubt, 160, "no force was found that moves the disc as far as it is pushed");
    for (size_t k = 0; k < count; k++) {
        const place_of_press *at = m->places + k;
        answer->error += (m->s[6] * at->size + m->s[7] * at->spread) / peak;
        sizes += at->size, most = fmax(most, at->size);
        if (!answer->doubt[0]) say_doubt(m, at, forces + 3 * k, answer->doubt);
    }
    answer->error += m->s[8] * (sizes - most) / peak;
    if (missed || !(answer->error <= 1)) answer->error = 1;
    return 0;
}
