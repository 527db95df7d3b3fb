/* Answer presses on a body from a portable model file; see palpate.h. */
#include "palpate.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double RESIDUAL_TOLERANCE = 1e-6, FORCE_SEARCH_TOLERANCE = 1e-6, FIRST_TOLERANCE = 0.1, HELD_COMPLIANCE = 2e-3, LEAST_EIGENVALUE = 0.03, MOST_MISSED = 0.1;
enum { VERSION = 2, HEAD = 144, ITERATIONS = 200, MOST_SEARCH_STEPS = 40, MOST_MODES = 256, MOST_CELLS = 4096 };
enum { TOUCH_ITERATIONS = 60, MOST_POINTS = 16384, MOST_PUSHES = 256, MOST_PLACES = 1024, FRAME = 12 };
static const double TOUCH_TOLERANCE = 1e-8, TOUCH_RESIDUAL = 1e-3, STEEPEST = 45, TILTED = 30, ROUNDING = 1 + 1e-6;
enum { MOST_VECTORS = 1024, MOST_PARTS = 8, MOST_PRESSES = 16, WIDE = 3 * MOST_PRESSES };

typedef struct {
    uint32_t r, m; const double *place, *normal, *bearing; double reach, noise;
    double *loads, *rest, *volumes, *mu, *lam, *slopes, *coefficients, *f;
} contact;
/* coordinates, and there the energy of the cells, its gradient and the smallest det F */
typedef struct { double q[MOST_MODES], pull[MOST_MODES], energy, least; } state;
/* a contact near a press: loads (3, r) of the press, how its coordinates move discs (3 a press, r), and the inverse of
   its stiffness (r, r), the identity until it is bent */
typedef struct { contact *one; double weight, *loads, *seen, *inverse; int bent; state now, before; } neighbour;
typedef struct {
    double disc[3 * MOST_VECTORS], more[MOST_VECTORS], apart, size, spread, least, far, left, force[3];
    neighbour near[3]; int known;
} place_of_press;
/* a place that a rigid instrument was prepared at: its cells, p points that may be touched, with their moves (3 p, r), and k
   past pushes. frames: of each point its gap, normal, two tangents, and how the instrument is curved along these */
typedef struct {
    contact cells; size_t p, k; double stretched, *axes, *first; const double *tilted; double *firm, *points, *moves, *areas, *penalty, *pushed, *starts;
    double *surface, *frames, *stiff, *soft, *rows;
} touch_place;
/* moved components, what they are to do, their responses to all forces, and the forces that move discs independently */
typedef struct {
    size_t moved[WIDE], size, kept, all;
    double wanted[WIDE], missed[WIDE], step[WIDE], linear[WIDE * WIDE], ways[WIDE * WIDE];
} search;
struct palpate_model {
    void *held; uint32_t n, t, stored, vectors, contacts_count, parts, modes, shapes_count; size_t answered; char *info;
    float *nodes, *normals, *by, *basis, *compliance, *moved; uint32_t *triangles, *from; contact *contacts;
    double s[12], shapes[3 * MOST_PARTS * MOST_PARTS], *areas, *facing, *middles, *weights, wide;
    uint32_t places_count; palpate_place *told; touch_place *touched;
    double part[3 * MOST_VECTORS], sum[MOST_VECTORS], loaded[MOST_VECTORS]; place_of_press places[MOST_PRESSES];
};
typedef struct { palpate_model *model; const unsigned char *bytes; size_t count, at; const char *why; } reader;

static uint32_t word(const unsigned char *p) {
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}
static double dot(const double *a, const double *b, size_t count) {
    double sums[4] = {0, 0, 0, 0}; size_t i = 0; /* four at once: a single one waits for itself */
    for (; i + 4 <= count; i += 4)
        for (size_t k = 0; k < 4; k++) sums[k] += a[i + k] * b[i + k];
    for (; i < count; i++) sums[0] += a[i] * b[i];
    return sums[0] + sums[1] + (sums[2] + sums[3]);
}
/* add a weight times the product of two vectors to a matrix */
static void outer(double *into, const double *a, const double *b, double weight, size_t count) {
    for (size_t i = 0; i < count; i++)
        for (size_t j = 0; j < count; j++) into[i * count + j] += weight * a[i] * b[j];
}
static double square_apart(const double *a, const double *b) {
    return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]);
}
static uint32_t crc32_of(const unsigned char *bytes, size_t count) {
    uint32_t crc = 0xffffffffu;
    for (size_t i = 0; i < 8 * count; i++) {
        if (i % 8 == 0) crc ^= bytes[i / 8];
        crc = crc & 1u ? (crc >> 1) ^ 0xedb88320u : crc >> 1;
    }
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
/* the next count numbers, as floats or doubles */
static void *reals(reader *in, size_t count, size_t size) {
    const unsigned char *p = take(in, count, 4); char *found = p ? keep(in, count, size) : NULL;
    for (size_t i = 0; found && i < count; i++) {
        const uint32_t w = word(p + 4 * i); float one; memcpy(&one, &w, 4); const double wide = one;
        memcpy(found + i * size, size == sizeof one ? (const void *)&one : &wide, size);
        if (!isfinite(one)) in->why = "a number is not finite";
    }
    return found;
}
static float *floats(reader *in, size_t count) { return reals(in, count, sizeof(float)); }
static double *doubles(reader *in, size_t count) { return reals(in, count, sizeof(double)); }
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
        const double cosine = dot(m->facing + 3 * e, normal, 3), weight = fmin(cosine / 0.1, 1) * m->areas[e];
        double x[9], sums[3] = {0, 0, 0}, at[3];
        if (square_apart(m->middles + 3 * e, point) >= near || !(cosine > 0)) continue;
        for (int k = 0; k < 9; k++) x[k] = m->nodes[3 * m->triangles[3 * e + k / 3] + k % 3];
        for (const double *w = m->shapes; w < m->shapes + 3 * m->shapes_count; w += 3) {
            for (int d = 0; d < 3; d++) at[d] = w[0] * x[d] + w[1] * x[3 + d] + w[2] * x[6 + d];
            const double part = 1 - square_apart(at, point) / square;
            for (int k = 0; part > 0 && k < 3; k++) sums[k] += w[k] * part;
        }
        for (int k = 0; k < 3; k++) add(m, m->triangles[3 * e + k], weight * sums[k]);
        total += weight * (sums[0] + sums[1] + sums[2]);
    }
    if (!(total > 0)) {
        uint32_t best = 0; double least = INFINITY;
        for (uint32_t i = 0; i < m->n; i++) {
            const double at[3] = {m->nodes[3 * i], m->nodes[3 * i + 1], m->nodes[3 * i + 2]}, apart = square_apart(at, point);
            if (apart < least) best = i, least = apart;
        }
        memset(m->weights, 0, m->stored * sizeof *m->weights); add(m, best, 1); total = 1;
    }
    memset(found, 0, 3 * m->vectors * sizeof *found);
    for (uint32_t i = 0; i < m->stored; i++) {
        const double weight = m->weights[i] / total;
        for (uint32_t d = 0; weight != 0 && d < 3; d++) {
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
    const double *places = doubles(in, 10), *loads = doubles(in, 3 * r); one->rest = doubles(in, r * r);
    one->volumes = doubles(in, m); one->mu = doubles(in, m); one->lam = doubles(in, m);
    one->slopes = scaled(in, 9 * m, r, 0); one->coefficients = scaled(in, r, b, 1);
    if (in->why) return;
    one->loads = keep(in, 3 * r, sizeof(double)); one->f = keep(in, 9 * m, sizeof(double));
    one->place = places, one->normal = places + 3, one->bearing = places + 6, one->reach = places[9];
    if (!(one->reach > 0)) in->why = "a contact reaches nowhere";
    if (in->why) return;
    for (size_t i = 0; i < m; i++) one->noise += 4e-15 * one->volumes[i] * (one->mu[i] + one->lam[i]);
    mean_over_disc(model, one->place, one->normal, model->part);
    for (size_t i = 0; i < 3 * r; i++) /* less its own, to which that of a press is added */
        one->loads[i] = loads[i % r * 3 + i / r] - dot(model->part + i / r * b, one->coefficients + i % r * b, b);
    model->modes = r > model->modes ? (uint32_t)r : model->modes;
}
static void read_place(const palpate_model *model, reader *in, palpate_place *told, touch_place *one) {
    const unsigned char *w = take(in, 6, 4); contact *cells = &one->cells;
    if (!w) return;
    const size_t r = cells->r = word(w + 8), m = cells->m = word(w + 12), p = one->p = word(w + 16), k = one->k = word(w + 20);
    told->node = word(w), told->kind = word(w + 4);
    if (told->node >= model->n || told->kind > 1 || r == 0 || r > MOST_MODES || m > MOST_CELLS || p > MOST_POINTS || k > MOST_PUSHES)
        in->why = "a place to touch has sizes that are none";
    const double *sizes = doubles(in, 8);
    if (in->why) return;
    told->radius = sizes[0], told->edge = sizes[1], told->deepest = sizes[2], one->stretched = sizes[3];
    told->error = sizes[4], told->force_error = sizes[5], one->tilted = sizes + 6;
    if (!(told->radius > 0 && told->edge >= 0 && told->edge <= told->radius && told->deepest > 0) || !(one->stretched >= 0 && told->error >= 0 && told->force_error >= 0 && sizes[6] >= 0 && sizes[7] >= 0))
        in->why = "a place to touch has lengths or errors that are none";
    one->axes = doubles(in, 9), one->first = doubles(in, 6), cells->rest = doubles(in, r * r);
    cells->volumes = doubles(in, m), cells->mu = doubles(in, m), cells->lam = doubles(in, m), cells->slopes = scaled(in, 9 * m, r, 0);
    one->points = doubles(in, 3 * p), one->moves = scaled(in, 3 * p, r, 0), one->areas = doubles(in, p), one->penalty = doubles(in, p);
    one->pushed = doubles(in, 3 * k), one->starts = doubles(in, k * r), one->surface = scaled(in, 3 * (size_t)model->n, r, 0);
    if (in->why) return;
    cells->f = keep(in, 9 * m, sizeof(double)), one->frames = keep(in, FRAME * p, sizeof(double));
    one->firm = keep(in, 3 * r * r, sizeof(double)), one->rows = keep(in, 7 * r, sizeof(double));
    if (in->why) return;
    one->stiff = one->firm + r * r, one->soft = one->stiff + r * r, memcpy(told->outward, one->axes + 6, sizeof told->outward);
    for (size_t i = 0; i < p; i++)
        if (!(one->penalty[i] > 0 && one->areas[i] >= 0)) in->why = "a place to touch has areas or stiffnesses that are none";
    for (size_t i = 0; i < m; i++) cells->noise += 4e-15 * cells->volumes[i] * (cells->mu[i] + cells->lam[i]);
    memcpy(one->firm, cells->rest, r * r * sizeof(double));
    for (size_t i = 0; i < 9 * m; i++)
        outer(one->firm, cells->slopes + i * r, cells->slopes + i * r, 2 * cells->mu[i % m] * cells->volumes[i % m], r);
}
static void split_triangle(palpate_model *m) {
    const uint32_t count = m->parts; double *at = m->shapes;
    for (uint32_t i = 0; i < count; i++)
        for (uint32_t j = 0; j < count - i; j++)
            for (uint32_t k = 1; k < (i + j + 1 < count ? 3u : 2u); k++, at += 3, m->shapes_count++) {
                at[0] = (3.0 * i + k) / (3.0 * count); at[1] = (3.0 * j + k) / (3.0 * count); at[2] = 1 - at[0] - at[1];
            }
}
/* areas, normals and middles of the triangles */
static void frame(palpate_model *m) {
    for (uint32_t e = 0; e < m->t; e++) {
        double x[9], p[3], q[3], *area = m->facing + 3 * e, *middle = m->middles + 3 * e;
        for (int k = 0; k < 9; k++) x[k] = m->nodes[3 * m->triangles[3 * e + k / 3] + k % 3], middle[k % 3] += x[k] / 3;
        for (int d = 0; d < 3; d++) p[d] = x[3 + d] - x[d], q[d] = x[6 + d] - x[d];
        for (int d = 0; d < 3; d++) area[d] = p[(d + 1) % 3] * q[(d + 2) % 3] - p[(d + 2) % 3] * q[(d + 1) % 3];
        m->areas[e] = sqrt(dot(area, area, 3));
        for (int d = 0; d < 3; d++) area[d] /= fmax(m->areas[e], 1e-300);
        for (int k = 0; k < 9; k += 3) m->wide = fmax(m->wide, sqrt(square_apart(x + k, middle)));
    }
}
static void read_surface(palpate_model *m, reader *in) {
    const size_t n = m->n, t = m->t, b = m->vectors, rows = 3 * (size_t)m->stored; m->nodes = floats(in, 3 * n);
    m->normals = floats(in, 3 * n);
    m->triangles = numbers(in, 3 * t, m->n, "a triangle has a node that is not there");
    m->from = numbers(in, 6 * n, m->stored, "a node is made of one that is not there");
    m->by = floats(in, 6 * n); const double *basis = scaled(in, b, rows, 1); m->compliance = floats(in, b * b);
    if (in->why) return;
    m->basis = keep(in, rows * b, sizeof(float)); m->moved = keep(in, rows, sizeof(float));
    for (size_t i = 0; m->basis && i < rows * b; i++) m->basis[i] = (float)basis[i % b * rows + i / b];
    m->areas = keep(in, t, sizeof(double)); m->facing = keep(in, 3 * t, sizeof(double));
    m->middles = keep(in, 3 * t, sizeof(double)); m->weights = keep(in, m->stored, sizeof(double));
    m->contacts = keep(in, m->contacts_count, sizeof(contact));
    if (!in->why) split_triangle(m), frame(m);
}
/* what is before the arrays; returns the length of the header's text */
static size_t read_head(palpate_model *m, reader *in) {
    const unsigned char *p = in->bytes; const size_t count = in->count;
    if (count < HEAD || memcmp(p, "palpate\n", 8) != 0) return in->why = "this is no portable model of palpate", 0;
    if (word(p + 8) < 1 || word(p + 8) > VERSION) return in->why = "this is a portable model of a version that is not 1 or 2, which are read here", 0;
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
    if (word(p + 8) == 1) m->s[11] = 0; /* places to touch, since version 2 */
    if (!in->why && !(m->s[11] <= MOST_PLACES && m->s[11] == floor(m->s[11]))) in->why = "its number of places to touch is none";
    if (!in->why) m->places_count = (uint32_t)m->s[11];
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
    if (!in.why) m->told = keep(&in, m->places_count, sizeof *m->told), m->touched = keep(&in, m->places_count, sizeof *m->touched);
    for (uint32_t i = 0; !in.why && i < m->places_count; i++) read_place(m, &in, m->told + i, m->touched + i);
    if (!in.why && in.at != count) in.why = "something follows its last array";
    for (int k = 0; !in.why && k < 3 * MOST_PRESSES; k++) {
        neighbour *near = m->places[k / 3].near + k % 3; near->loads = keep(&in, (3 + WIDE + m->modes) * m->modes, sizeof(double));
        near->seen = near->loads + 3 * m->modes, near->inverse = near->loads + (3 + WIDE) * m->modes;
    }
    if (!in.why) return m;
    snprintf(why, 160, "%s", in.why); palpate_free(m);
    return NULL;
}
void palpate_free(palpate_model *m) {
    for (void **each = m ? m->held : NULL, **next; each; each = next) next = each[0], free(each);
    free(m);
}
uint32_t palpate_nodes(const palpate_model *m, const float **positions) { return positions ? *positions = m->nodes, m->n : m->n; }
uint32_t palpate_triangles(const palpate_model *m, const uint32_t **corners) { return corners ? *corners = m->triangles, m->t : m->t; }
const char *palpate_info(const palpate_model *m) { return m->info; }
/* of F: its cofactors, det F, I and s = tr R'F, the largest root of (s^2 - I)^2 = 4 II + 8 J s, I, II and J^2 being the
   invariants of F'F; R = ds/dF */
static double stretch(const double *F, double *C, double *first, double *det) {
    double second = 0; *first = 0;
    C[0] = F[4] * F[8] - F[5] * F[7], C[1] = F[5] * F[6] - F[3] * F[8], C[2] = F[3] * F[7] - F[4] * F[6];
    C[3] = F[2] * F[7] - F[1] * F[8], C[4] = F[0] * F[8] - F[2] * F[6], C[5] = F[1] * F[6] - F[0] * F[7];
    C[6] = F[1] * F[5] - F[2] * F[4], C[7] = F[2] * F[3] - F[0] * F[5], C[8] = F[0] * F[4] - F[1] * F[3];
    for (int i = 0; i < 9; i++) *first += F[i] * F[i], second += C[i] * C[i];
    *det = F[0] * C[0] + F[1] * C[1] + F[2] * C[2]; double s = sqrt(3 * *first);
    for (int turn = 0; turn < 30; turn++) {
        const double off = s * s - *first;
        const double change = (off * off - 4 * second - 8 * *det * s) / fmax(4 * s * off - 8 * *det, 1e-12);
        s -= change;
        if (!(fabs(change) > 1e-13 * s)) break;
    }
    return s;
}
/* F F'F */
static void cubed(const double *F, double *S) {
    double G[9];
    for (int i = 0; i < 9; i++) G[i] = F[i / 3] * F[i % 3] + F[3 + i / 3] * F[3 + i % 3] + F[6 + i / 3] * F[6 + i % 3];
    for (int i = 0; i < 9; i++) S[i] = F[i / 3 * 3] * G[i % 3] + F[i / 3 * 3 + 1] * G[3 + i % 3] + F[i / 3 * 3 + 2] * G[6 + i % 3];
}
/* energy of a contact's cells, its gradient (r) and the smallest det F */
static double evaluate(contact *one, const double *q, double *gradient, double *least) {
    const size_t r = one->r, m = one->m; double energy = 0, *f = one->f; *least = INFINITY;
    for (size_t i = 0; i < 9 * m; i++) f[i] = dot(one->slopes + i * r, q, r);
    for (size_t k = 0; k < m; k++) {
        double F[9], C[9], S[9], first, det;
        for (int i = 0; i < 9; i++) F[i] = f[i * m + k] + (i % 4 == 0);
        const double s = stretch(F, C, &first, &det);
        const double off = s * s - first, mu = one->mu[k], lam = one->lam[k], volume = one->volumes[k];
        energy += volume * (mu * (first - 2 * s + 3) + 0.5 * lam * (s - 3) * (s - 3));
        const double bottom = fmax(s * off - 2 * det, 1e-12), turned = (lam * (s - 3) - 2 * mu) * volume / bottom;
        const double own = 2 * mu * volume + turned * (off + 2 * first);
        cubed(F, S);
        for (int i = 0; i < 9; i++) f[i * m + k] = own * F[i] - 2 * turned * S[i] + 2 * s * turned * C[i];
        if (!(det >= *least)) *least = det;
    }
    for (size_t i = 0; i < r; i++) gradient[i] = dot(one->rest + i * r, q, r), energy += 0.5 * q[i] * gradient[i];
    for (size_t i = 0; i < 9 * m; i++)
        for (size_t k = 0; k < r; k++) gradient[k] += f[i] * one->slopes[i * r + k];
    return energy;
}
/* by how much a load would change the coordinates: the inverse of the stiffness, as far as steps have shown it */
static void bent_by(const neighbour *at, const double *load, double *found) {
    const size_t r = at->one->r;
    for (size_t i = 0; i < r; i++) found[i] = at->bent ? dot(at->inverse + i * r, load, r) : load[i];
}
/* what a step to the next coordinates shows of it, by the method of Broyden, Fletcher, Goldfarb and Shanno */
static void learn(neighbour *at, const state *next) {
    double step[MOST_MODES], bend[MOST_MODES], along[MOST_MODES], *b = at->inverse; const size_t r = at->one->r;
    for (size_t i = 0; i < r; i++) step[i] = next->q[i] - at->now.q[i], bend[i] = next->pull[i] - at->now.pull[i];
    const double curvature = dot(step, bend, r);
    if (!(curvature > 0)) return;
    for (size_t i = 0; !at->bent && i < r * r; i++) b[i] = i % (r + 1) == 0;
    at->bent = 1, bent_by(at, bend, along); const double both = (1 + dot(bend, along, r) / curvature) / curvature;
    for (size_t i = 0; i < r; i++)
        for (size_t j = 0; j < r; j++) b[i * r + j] += both * step[i] * step[j] - (along[i] * step[j] + step[i] * along[j]) / curvature;
}
/* minimise the energy less the work of the load, from where it is on; returns the residual over the load */
static double settle(neighbour *at, const double *load, double enough) {
    double left[MOST_MODES], ahead[MOST_MODES]; state next, *now = &at->now; contact *one = at->one;
    const size_t r = one->r; const double size = sqrt(dot(load, load, r));
    for (int turn = 0;; turn++) {
        for (size_t i = 0; i < r; i++) left[i] = load[i] - now->pull[i];
        const double residual = sqrt(dot(left, left, r));
        if (residual <= enough * size || turn == ITERATIONS) return residual / fmax(size, 1e-300);
        bent_by(at, left, ahead); const double energy = now->energy - dot(load, now->q, r), slope = dot(left, ahead, r);
        double length = 1; int found = 0;
        while (slope > 0 && length > 1e-4) {
            for (size_t i = 0; i < r; i++) next.q[i] = now->q[i] + length * ahead[i];
            next.energy = evaluate(one, next.q, next.pull, &next.least);
            const double lower = next.energy - dot(load, next.q, r);
            if ((found = lower <= energy - 1e-4 * length * slope + 1e-12 * fabs(energy) + one->noise)) break;
            length *= 0.5;
        }
        if (!found && !at->bent) return residual / fmax(size, 1e-300);
        if (found) learn(at, &next), *now = next;
        else at->bent = 0;
    }
}
/* how a contact's coordinates move a component of a disc, into a row of its own */
static void see(const palpate_model *m, neighbour *near, size_t row, const double *component) {
    const size_t r = near->one ? near->one->r : 0, b = m->vectors;
    for (size_t i = 0; i < r; i++) near->seen[row * r + i] = dot(component, near->one->coefficients + i * b, b);
}
/* what a press needs, at its point of the surface; 0, or -1 with a sentence */
static int find_place(palpate_model *m, const palpate_press *press, place_of_press *at, int go_on, char *why) {
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
    for (contact *one = m->contacts; one < m->contacts + m->contacts_count; one++) {
        const double far = sqrt(square_apart(one->place, point) + m->s[0] * m->s[0] * square_apart(one->normal, normal)); int k = 4;
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
    for (int k = 0; k < 3; k++)
        if (!(shares[k] > 1e-3 * total)) order[k] = NULL, shares[k] = 0;
    at->apart = apart[0], at->known = 0;
    for (int i = 0; i < 9; i++)
        if (order[i / 3] && at->near[i % 3].one == order[i / 3]) { /* what an earlier press has left comes to its place */
            const neighbour other = at->near[i % 3]; at->near[i % 3] = at->near[i / 3], at->near[i / 3] = other;
        }
    for (int k = 0; k < 3; k++) {
        neighbour *near = at->near + k; contact *one = order[k];
        if (one && one == near->one && go_on) at->known = 1;
        else memset(&near->now, 0, sizeof near->now), near->now.least = 1, near->bent = 0;
        near->one = one, near->weight = shares[k] / (shares[0] + shares[1] + shares[2]);
        for (size_t d = 0, row = 3 * (size_t)(at - m->places); one && d < 3; d++, row++) {
            see(m, near, row, at->disc + d * m->vectors);
            for (size_t i = 0; i < one->r; i++) near->loads[d * one->r + i] = one->loads[d * one->r + i] + near->seen[row * one->r + i];
        }
    }
    return 0;
}
static void load_of(const neighbour *at, const double *force, double *load) {
    const double *loads = at->loads; const size_t r = at->one->r;
    for (size_t i = 0; i < r; i++) load[i] = force[0] * loads[i] + force[1] * loads[r + i] + force[2] * loads[2 * r + i];
}
/* what a press has beyond its linear part */
static void bend(palpate_model *m, place_of_press *at, const double *force) {
    const size_t b = m->vectors; double load[MOST_MODES]; memset(at->more, 0, b * sizeof *at->more);
    at->least = INFINITY, at->far = at->left = at->spread = 0, memcpy(at->force, force, sizeof at->force);
    for (int k = 0; k < 3 && at->near[k].one; k++) {
        neighbour *near = at->near + k; contact *one = near->one; double *part = m->part + k * b;
        load_of(near, force, load), at->left = fmax(at->left, settle(near, load, RESIDUAL_TOLERANCE));
        at->least = fmin(at->least, near->now.least), at->far = fmax(at->far, sqrt(dot(near->now.q, near->now.q, one->r)) / one->reach), memset(part, 0, b * sizeof *part);
        for (uint32_t i = 0; i < one->r; i++)
            for (size_t v = 0; v < b; v++) part[v] += (near->now.q[i] - load[i]) * one->coefficients[i * b + v];
        for (size_t v = 0; v < b; v++) at->more[v] += near->weight * part[v];
    }
    for (size_t i = 0; i < 3 * b; i++)
        if (at->near[i / b].one) at->spread += at->near[i / b].weight * (m->part[i] - at->more[i % b]) * (m->part[i] - at->more[i % b]);
    at->spread = sqrt(at->spread); at->size = sqrt(dot(at->more, at->more, b));
}
/* coordinates of all presses in the vectors, into m->sum */
static void all(palpate_model *m, size_t count, const double *forces) {
    const size_t b = m->vectors; memset(m->loaded, 0, b * sizeof *m->loaded), memset(m->sum, 0, b * sizeof *m->sum);
    for (size_t k = 0; k < 3 * count; k++)
        for (size_t v = 0; v < b; v++) m->loaded[v] += forces[k] * m->places[k / 3].disc[k % 3 * b + v];
    for (size_t i = 0; i < b; i++)
        for (size_t j = 0; j < b; j++) m->sum[j] += m->compliance[i * b + j] * m->loaded[i]; /* it is symmetric */
    for (size_t k = 0; k < count; k++) {
        bend(m, m->places + k, forces + 3 * k);
        for (size_t v = 0; v < b; v++) m->sum[v] += m->places[k].more[v];
    }
}
/* eigenvectors of a symmetric matrix, in columns, by Jacobi's rotations; its diagonal becomes the eigenvalues */
static void eigen(double *a, double *vectors, size_t n) {
    for (size_t i = 0; i < n * n; i++) vectors[i] = i % (n + 1) == 0;
    for (size_t turn = 0; turn < 30 * n * n; turn++) {
        const size_t p = turn / n % n, q = turn % n;
        const double off = a[p * n + q], apart = a[q * n + q] - a[p * n + p];
        if (q <= p || !(fabs(off) > 1e-18 * (fabs(a[p * n + p]) + fabs(a[q * n + q])))) continue;
        const double t = (apart < 0 ? -2 : 2) * off / (fabs(apart) + sqrt(apart * apart + 4 * off * off));
        const double c = 1 / sqrt(t * t + 1), s = t * c;
        for (size_t k = 0; k < 3 * n; k++) { /* columns of the matrix and of the vectors, then rows */
            double *x = k < n ? a + k * n + p : k < 2 * n ? vectors + (k - n) * n + p : a + p * n + k - 2 * n;
            double *y = x + (k < 2 * n ? q - p : (q - p) * n); const double old = *x;
            *x = c * old - s * *y, *y = s * old + c * *y;
        }
    }
}
/* solve by elimination, of a matrix whose pivots are above 0; otherwise the answer is 0 */
static void solve(double *a, double *x, size_t n) {
    for (size_t k = 0; k < n; k++) {
        if (!(a[k * n + k] > 0)) memset(x, 0, n * sizeof *x);
        for (size_t i = 0; a[k * n + k] > 0 && i < n; i++) {
            const double by = (a[i * n + k] - (i == k)) / a[k * n + k]; x[i] -= by * x[k];
            for (size_t j = n; j-- > k;) a[i * n + j] -= by * a[k * n + j];
        }
    }
}
/* forces that move discs independently: each disc counts over its mean response, not at all if that is what a held one
   has, and discs that are nearly the same one move alike only */
static void find_ways(search *s, double held) {
    double linear[WIDE * WIDE], axes[WIDE * WIDE], by[WIDE]; const size_t n = s->size;
    for (size_t i = 0; i < n; i++) {
        const double *row = s->linear + s->all * (i / 3 * 3); const size_t *own = s->moved + i / 3 * 3;
        const double mean = (row[own[0]] + row[s->all + own[1]] + row[2 * s->all + own[2]]) / 3;
        by[i] = mean > held ? 1 / sqrt(mean) : 0;
    }
    for (size_t i = 0; i < n * n; i++) linear[i] = by[i / n] * by[i % n] * s->linear[i / n * s->all + s->moved[i % n]];
    eigen(linear, axes, n), s->kept = 0;
    for (size_t j = 0; j < n; j++)
        for (size_t i = (s->kept += linear[j * n + j] > LEAST_EIGENVALUE, 0); linear[j * n + j] > LEAST_EIGENVALUE && i < n; i++)
            s->ways[(s->kept - 1) * n + i] = by[i] * axes[i * n + j];
}
/* what independent ways have of displacements of the discs; returns its norm */
static double along_ways(const search *s, const double *x, double *found) {
    for (size_t j = 0; j < s->kept; j++) found[j] = dot(s->ways + j * s->size, x, s->size);
    return sqrt(dot(found, found, s->kept));
}
/* what discs miss, and a step towards it that foresees where contacts will rest; returns how far both are */
static double look_ahead(palpate_model *m, const double *force, search *s) {
    double slope[WIDE * WIDE], square[WIDE * WIDE], x[WIDE], y[WIDE], rest[WIDE] = {0}, load[MOST_MODES], ahead[MOST_MODES];
    const size_t n = s->size, kept = s->kept; memcpy(slope, s->linear, sizeof slope), memset(s->step, 0, sizeof s->step);
    for (size_t i = 0; i < n; i++) s->missed[i] = s->wanted[i] - dot(s->linear + i * s->all, force, s->all);
    for (size_t k = 0; k < 5 * s->all; k++) { /* of each contact near: what three loads do, where it is, where it will be */
        const size_t d = k % 5, press = k / 15 * 3; const neighbour *at = m->places[k / 15].near + k / 5 % 3;
        const size_t r = at->one ? at->one->r : 0; const double *loads = at->loads + d * r;
        if (r) load_of(at, force + press, load);
        for (size_t i = 0; d == 4 && i < r; i++) load[i] -= at->now.pull[i];
        if (r) bent_by(at, d < 3 ? loads : load, ahead);
        for (size_t i = 0; d < 4 && i < r; i++) ahead[i] = d < 3 ? ahead[i] - loads[i] : at->now.q[i] - load[i];
        for (size_t i = 0; r && i < n; i++) {
            double *sum = d < 3 ? slope + i * s->all + press + d : d < 4 ? s->missed + i : rest + i;
            *sum += (d == 3 ? -at->weight : at->weight) * dot(at->seen + s->moved[i] * r, ahead, r);
        }
    }
    for (size_t i = 0; i < kept * kept; i++)
        for (size_t p = (square[i] = 0, 0); p < n; p++)
            for (size_t q = 0; q < n; q++)
                square[i] += s->ways[i / kept * n + p] * slope[p * s->all + s->moved[q]] * s->ways[i % kept * n + q];
    const double most = along_ways(s, s->missed, x) + along_ways(s, rest, y);
    for (size_t i = 0; i < kept; i++) x[i] -= y[i];
    solve(square, x, kept);
    for (size_t i = 0; i < n * kept; i++) s->step[s->moved[i % n]] += s->ways[i] * x[i / n];
    return most;
}
/* bring all contacts to rest, or back to where they were */
static void rest_all(palpate_model *m, size_t count, const double *force, double enough) {
    double load[MOST_MODES];
    for (size_t k = 0; k < 3 * count; k++) {
        neighbour *at = m->places[k / 3].near + k % 3;
        if (at->one && force) at->before = at->now, load_of(at, force + k / 3 * 3, load), settle(at, load, enough);
        else at->now = at->before;
    }
}
/* find the forces of moved discs by Newton's method; returns by how much they are missed [m] */
static double find_forces(palpate_model *m, const palpate_press *presses, size_t count, double *force, char *doubt) {
    search s; double x[WIDE], step[WIDE], tried[WIDE], others[WIDE] = {0}; const size_t b = m->vectors;
    s.size = 0, s.all = 3 * count;
    for (size_t i = 0; i < s.all; i++)
        if (presses[i / 3].moves) s.wanted[s.size] = presses[i / 3].given[i % 3], s.moved[s.size++] = i;
    for (size_t i = 0; i < s.size; i++) {
        const double *mine = m->places[s.moved[i] / 3].disc + s.moved[i] % 3 * b; memset(m->loaded, 0, b * sizeof *m->loaded);
        for (size_t a = 0; a < b; a++)
            for (size_t c = 0; c < b; c++) m->loaded[c] += mine[a] * m->compliance[a * b + c];
        for (size_t j = 0; j < s.all; j++) {
            const double found = s.linear[i * s.all + j] = dot(m->loaded, m->places[j / 3].disc + j % 3 * b, b);
            others[i] += presses[j / 3].moves ? 0 : found * force[j], see(m, m->places[j / 3].near + j % 3, s.moved[i], mine);
        }
    }
    find_ways(&s, m->s[10] > 0 ? HELD_COMPLIANCE * m->s[9] / m->s[10] : 0);
    look_ahead(m, force, &s), memcpy(step, s.step, sizeof step);
    const double scale = fmax(fmax(along_ways(&s, s.wanted, x), along_ways(&s, others, x)), 1e-300);
    const double way = fmax(sqrt(fmax(dot(s.wanted, s.wanted, s.size), dot(others, others, s.size))), 1e-300); /* a held disc has one */
    double size = scale, tolerance = FIRST_TOLERANCE, most = sqrt(dot(s.missed, s.missed, s.size));
    for (int turn = 0; turn < MOST_SEARCH_STEPS && !(size <= FORCE_SEARCH_TOLERANCE * scale && tolerance <= RESIDUAL_TOLERANCE); turn++) {
        tolerance = fmax(RESIDUAL_TOLERANCE, FIRST_TOLERANCE * fmin(1, size / scale));
        for (size_t i = 0; i < s.all; i++) tried[i] = force[i] + step[i];
        rest_all(m, count, tried, tolerance); const double found = look_ahead(m, tried, &s);
        const int nearer = found < 1.5 * size || found <= FORCE_SEARCH_TOLERANCE * scale;
        for (size_t i = 0; i < s.all; i++) step[i] = nearer ? s.step[i] : 0.5 * step[i];
        if (!nearer) rest_all(m, count, NULL, 0);
        else memcpy(force, tried, s.all * sizeof *force), size = found, most = sqrt(dot(s.missed, s.missed, s.size));
    }
    if (!(size <= 1e-3 * scale)) snprintf(doubt, 160, "no force was found that moves the disc as far as it is pushed");
    else if (!(most <= MOST_MISSED * way)) snprintf(doubt, 160, "a disc is held there, or too near another, and misses its way by %.0f %%", 100 * most / way);
    return most;
}
static void say_doubt(const palpate_model *m, const place_of_press *at, const double *force, char *doubt) {
    double hard = 0;
    for (int k = 0; k < 3 && at->near[k].one; k++) hard += at->near[k].weight * dot(at->near[k].one->bearing, force, 3);
    if (!(at->left <= 1e-3)) snprintf(doubt, 160, "the model found no rest: %.1f %% of the load are left", 100 * at->left);
    else if (!(at->least >= m->s[1])) snprintf(doubt, 160, "cells are squeezed to det F = %.2f, beyond what the contact's model was made for", at->least);
    else if (!(at->far <= m->s[2])) snprintf(doubt, 160, "this goes %.1f times as far as what the contact's model is made of", at->far);
    else if (!(hard <= m->s[3])) snprintf(doubt, 160, "this presses %.2f times as hard as finer elements are known to bear", hard);
    else if (!(at->apart <= m->s[4])) snprintf(doubt, 160, "the nearest place that was prepared is %.0f mm away", 1e3 * at->apart);
}
/* bring coordinates to all nodes; returns the largest displacement, or NAN */
static double expand(palpate_model *m, float *out) {
    const size_t b = m->vectors; float x[MOST_VECTORS]; double most = 0; int sound = 1;
    for (size_t v = 0; v < b; v++) x[v] = (float)m->sum[v], sound = sound && isfinite(x[v]);
    for (size_t i = 0; i < 3 * (size_t)m->stored; i++) {
        const float *row = m->basis + i * b; float parts[8] = {0, 0, 0, 0, 0, 0, 0, 0}; size_t v = 0;
        for (; v + 8 <= b; v += 8)
            for (size_t k = 0; k < 8; k++) parts[k] += row[v + k] * x[v + k];
        for (; v < b; v++) parts[v % 8] += row[v] * x[v];
        m->moved[i] = (parts[0] + parts[4]) + (parts[1] + parts[5]) + ((parts[2] + parts[6]) + (parts[3] + parts[7]));
    }
    for (size_t i = 0; i < m->n; i++, out += 3) {
        float at[3] = {0, 0, 0};
        for (size_t j = 18 * i; j < 18 * i + 18; j++) at[j % 3] += m->by[j / 3] * m->moved[3 * m->from[j / 3] + j % 3];
        const double square = (double)at[0] * at[0] + (double)at[1] * at[1] + (double)at[2] * at[2];
        sound = sound && isfinite(square), most = fmax(most, square), memcpy(out, at, sizeof at);
    }
    return sound ? sqrt(most) : NAN;
}
int palpate_respond(palpate_model *m, const palpate_press *presses, size_t count, int go_on, float *displacement,
                    double *forces, palpate_answer *answer) {
    double sizes = 0, most = 0, missed = 0; int finite = 1, moves = 0;
    answer->doubt[0] = 0, answer->error = 1;
    if (count > MOST_PRESSES) return snprintf(answer->doubt, 160, "more than %d presses are asked for", MOST_PRESSES), -1;
    const size_t answered = go_on ? m->answered : 0; m->answered = 0;
    for (size_t k = 0; k < count; k++)
        if (find_place(m, presses + k, m->places + k, k < answered, answer->doubt)) return -1;
    for (size_t i = 0; i < 3 * count; i++) {
        const palpate_press *press = presses + i / 3; const place_of_press *at = m->places + i / 3;
        forces[i] = !press->moves ? press->given[i % 3] : at->known ? at->force[i % 3] : 0, moves = moves || press->moves;
    }
    if (moves) missed = find_forces(m, presses, count, forces, answer->doubt);
    all(m, count, forces); const double found = expand(m, displacement);
    for (size_t i = 0; i < 3 * count; i++) finite = finite && isfinite((float)forces[i]);
    if (!isfinite(found) || !finite) {
        memset(displacement, 0, 3 * (size_t)m->n * sizeof *displacement);
        memset(forces, 0, 3 * count * sizeof *forces);
        snprintf(answer->doubt, 160, "the numbers of this answer are beyond what can be stored");
        return 0;
    }
    const double peak = fmax(found, 1e-30); const int lost = answer->doubt[0] != 0; answer->error = m->s[5] + missed / peak;
    for (size_t k = 0; k < count; k++) {
        const place_of_press *at = m->places + k;
        answer->error += (m->s[6] * at->size + m->s[7] * at->spread) / peak;
        sizes += at->size, most = fmax(most, at->size);
        if (!answer->doubt[0]) say_doubt(m, at, forces + 3 * k, answer->doubt);
    }
    answer->error += m->s[8] * (sizes - most) / peak;
    if (lost || !(answer->error <= 1)) answer->error = 1;
    if (!answer->doubt[0]) m->answered = count;
    return go_on && answer->doubt[0] ? palpate_respond(m, presses, count, 0, displacement, forces, answer) : 0;
}
uint32_t palpate_places(const palpate_model *m, const palpate_place **places) { return places ? *places = m->told, m->places_count : m->places_count; }
/* the frame of a point from the tip; inside, the nearer of end and side counts. A ball is a punch whose edge is its radius,
   its upper half, which is never reached, a cylinder */
static void see_point(const palpate_place *told, const double *axes, const double *at, double *frame) {
    const double x = dot(axes, at, 3), y = dot(axes + 3, at, 3), z = dot(axes + 6, at, 3), edge = told->edge;
    const double rho = sqrt(x * x + y * y), safe = fmax(rho, 1e-300), out = rho - (told->radius - edge), below = edge - z;
    const int edged = out > 0 && below > 0; const double away = edged ? sqrt(out * out + below * below) : fmax(out, below);
    const double far = edged ? fmax(away, 1e-300) : 1, side = edged ? out / far : out > below, down = edged ? below / far : out <= below;
    frame[0] = away - edge, frame[10] = side / safe, frame[11] = edged ? 1 / far : 0;
    for (int d = 0; d < 3; d++) {
        const double radial = (x * axes[d] + y * axes[3 + d]) / safe;
        frame[1 + d] = side * radial - down * axes[6 + d], frame[4 + d] = (x * axes[3 + d] - y * axes[d]) / safe;
        frame[7 + d] = down * radial + side * axes[6 + d];
    }
}
/* energy of a place's cells and of contact with the instrument, its gradient (r), and the pull of contact (r) */
static double touch_energy(touch_place *one, const palpate_place *told, const double *tip, const double *q, double *gradient, double *pull) {
    const size_t r = one->cells.r; double least, energy = evaluate(&one->cells, q, gradient, &least);
    memset(pull, 0, r * sizeof *pull);
    for (size_t n = 0; n < one->p; n++) {
        double at[3], *frame = one->frames + FRAME * n; const double *moves = one->moves + 3 * n * r;
        for (size_t d = 0; d < 3; d++) at[d] = one->points[3 * n + d] + dot(moves + d * r, q, r) - tip[d];
        see_point(told, one->axes, at, frame);
        const double over = fmax(-frame[0], 0), push = one->areas[n] * one->penalty[n] * over; energy += 0.5 * push * over;
        for (size_t i = 0; push > 0 && i < r; i++) pull[i] += push * (frame[1] * moves[i] + frame[2] * moves[r + i] + frame[3] * moves[2 * r + i]);
    }
    for (size_t i = 0; i < r; i++) gradient[i] -= pull[i];
    return energy;
}
/* what of the Hessian is positive definite, into one->stiff, and the rest, rotations and the instrument's curves, into
   one->soft. R turns by 1/G a, where a is the axis of dF R' - R dF' and G = s I - F R' */
static void touch_stiffness(touch_place *one, const double *q) {
    const contact *cells = &one->cells; const size_t r = cells->r, m = cells->m; double *rows = one->rows;
    memcpy(one->stiff, one->firm, r * r * sizeof(double)), memset(one->soft, 0, r * r * sizeof(double));
    for (size_t k = 0; k < m; k++) {
        double F[9], C[9], S[9], R[9], G[9], A[9], first, det;
        for (size_t i = 0; i < 9; i++) F[i] = dot(cells->slopes + (i * m + k) * r, q, r) + (i % 4 == 0);
        const double s = stretch(F, C, &first, &det), off = s * s - first, bottom = fmax(s * off - 2 * det, 1e-12);
        cubed(F, S), memset(rows, 0, 7 * r * sizeof *rows);
        for (int i = 0; i < 9; i++) R[i] = (off * F[i] + 2 * (first * F[i] - S[i]) + 2 * s * C[i]) / bottom;
        for (int i = 0; i < 9; i++) A[i] = dot(F + i / 3 * 3, R + i % 3 * 3, 3);
        for (int i = 0; i < 9; i++) G[i] = s * (i % 4 == 0) - 0.5 * (A[i] + A[i % 3 * 3 + i / 3]);
        for (int i = 0; i < 9; i++) { /* cofactors of G, which is symmetric */
            const int a = (i / 3 + 1) % 3 * 3, b = (i / 3 + 2) % 3 * 3, c = (i + 1) % 3, d = (i + 2) % 3;
            C[i] = G[a + c] * G[b + d] - G[a + d] * G[b + c];
        }
        const double size = dot(G, C, 3), share = cells->volumes[k] * (cells->lam[k] * (s - 3) - 2 * cells->mu[k]) / size;
        for (size_t i = 0; i < 9; i++) {
            const double *slope = cells->slopes + (i * m + k) * r, *turn = R + i % 3;
            const size_t a = (i / 3 + 2) % 3, b = (i / 3 + 1) % 3;
            for (size_t j = 0; j < r; j++) { /* dF R' has the entries of row i / 3 in columns a and b */
                rows[j] += R[i] * slope[j];
                rows[(1 + b) * r + j] += turn[3 * a] * slope[j], rows[(1 + a) * r + j] -= turn[3 * b] * slope[j];
            }
        }
        outer(one->stiff, rows, rows, cells->lam[k] * cells->volumes[k], r);
        if (!(size > 1e-6)) continue;
        for (size_t i = 0; i < 9 * r; i++) rows[(4 + i / r / 3) * r + i % r] += C[i / r] * rows[(1 + i / r % 3) * r + i % r];
        for (size_t i = 1; i < 4; i++) outer(one->soft, rows + i * r, rows + (3 + i) * r, share, r);
    }
    for (size_t n = 0; n < one->p; n++) {
        const double *frame = one->frames + FRAME * n, *moves = one->moves + 3 * n * r, stiff = one->areas[n] * one->penalty[n];
        for (size_t v = 0; frame[0] < 0 && v < 3; v++) {
            const double *way = frame + 1 + 3 * v;
            for (size_t i = 0; i < r; i++) rows[i] = way[0] * moves[i] + way[1] * moves[r + i] + way[2] * moves[2 * r + i];
            outer(v ? one->soft : one->stiff, rows, rows, v ? stiff * frame[0] * frame[9 + v] : stiff, r);
        }
    }
}
/* minimise the energy of a place from q on by Newton's method, and, where its matrix is not positive definite, by what of
   it always is; returns the residual over the force of contact */
static double settle_touch(touch_place *one, const palpate_place *told, const double *tip, double *q) {
    double gradient[MOST_MODES], next[MOST_MODES], pull[MOST_MODES], tried[MOST_MODES], step[MOST_MODES], scale = 0;
    const size_t r = one->cells.r; double energy = touch_energy(one, told, tip, q, gradient, pull);
    for (int turn = 0;; turn++) {
        const double force = sqrt(dot(pull, pull, r)), size = sqrt(dot(gradient, gradient, r)); scale = force > 0 ? force : scale;
        const double left = size > 0 && scale > 0 ? size / scale : size;
        if (left <= TOUCH_TOLERANCE || turn == TOUCH_ITERATIONS) return left;
        touch_stiffness(one, q);
        for (size_t i = 0; i < r * r; i++) one->soft[i] += one->stiff[i];
        for (size_t i = 0; i < r; i++) step[i] = -gradient[i];
        solve(one->soft, step, r);
        if (!(dot(gradient, step, r) < 0)) {
            for (size_t i = 0; i < r; i++) step[i] = -gradient[i];
            solve(one->stiff, step, r);
        }
        const double slope = dot(gradient, step, r); double length = 1; int found = 0;
        while (slope < 0 && length > 1e-4) {
            for (size_t i = 0; i < r; i++) tried[i] = q[i] + length * step[i];
            const double lower = touch_energy(one, told, tip, tried, next, pull);
            if ((found = lower <= energy + 1e-4 * length * slope + 1e-12 * fabs(energy) + one->cells.noise)) {
                energy = lower, memcpy(q, tried, r * sizeof *q), memcpy(gradient, next, r * sizeof *q);
                break;
            }
            length *= 0.5;
        }
        if (!found) return touch_energy(one, told, tip, q, gradient, pull), left;
    }
}
int palpate_touch(palpate_model *m, uint32_t place, double depth, const double *direction, float *displacement, palpate_touched *answer) {
    double way[3], local[3], q[MOST_MODES] = {0}; const char *wrong = NULL;
    memset(answer, 0, sizeof *answer);
    if (place >= m->places_count) return snprintf(answer->doubt, 160, "the touch is at a place which is not there"), -1;
    touch_place *one = m->touched + place; const palpate_place *told = m->told + place; const size_t r = one->cells.r;
    for (int d = 0; d < 3; d++) way[d] = direction ? direction[d] : -one->axes[6 + d];
    const double length = sqrt(dot(way, way, 3));
    if (!isfinite(depth) || depth < 0) wrong = "a touch needs a finite depth of 0 or more";
    else if (!(length > 0 && length < INFINITY)) wrong = "the direction of a touch has no length";
    if (wrong) return snprintf(answer->doubt, 160, "%s", wrong), -1;
    for (int d = 0; d < 3; d++) way[d] /= length;
    for (int d = 0; d < 3; d++) local[d] = dot(one->axes + 3 * d, way, 3);
    const double x = local[0], y = local[1], *c = one->first;
    const double along = c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y + depth;
    for (int d = 0; d < 3; d++) answer->tip[d] = m->nodes[3 * told->node + d] + along * way[d];
    for (size_t k = 0; k < one->k; k++) {
        const double alike = dot(one->pushed + 3 * k, local, 3) * depth / told->deepest, by = alike + alike * alike + alike * alike * alike;
        for (size_t i = 0; i < r; i++) q[i] += by * one->starts[k * r + i];
    }
    const double left = settle_touch(one, told, answer->tip, q); int sound = 1;
    for (size_t n = 0; n < one->p; n++) {
        const double *frame = one->frames + FRAME * n, push = one->areas[n] * one->penalty[n] * fmax(-frame[0], 0);
        for (int d = 0; d < 3; d++) answer->force[d] += push * frame[1 + d];
        answer->area += frame[0] < 0 ? one->stretched * one->areas[n] : 0;
    }
    answer->along = dot(answer->force, way, 3);
    const double share = fmin(sqrt(x * x + y * y) / sin(TILTED * 0.017453292519943295), 1);
    answer->error = told->error + share * fmax(one->tilted[0] - told->error, 0);
    answer->force_error = told->force_error + share * fmax(one->tilted[1] - told->force_error, 0);
    for (size_t i = 0; i < 3 * (size_t)m->n; i++) displacement[i] = (float)dot(one->surface + i * r, q, r), sound = sound && isfinite(displacement[i]);
    if (!sound || !isfinite(answer->along) || !isfinite(left)) {
        memset(displacement, 0, 3 * (size_t)m->n * sizeof *displacement), memset(answer->force, 0, sizeof answer->force);
        answer->along = answer->area = 0, answer->error = answer->force_error = 1;
        snprintf(answer->doubt, 160, "the numbers of this answer are beyond what can be stored");
    } else if (!(left <= TOUCH_RESIDUAL)) snprintf(answer->doubt, 160, "the model found no rest: %.1f %% of the load are left", 100 * left);
    else if (!(depth <= ROUNDING * told->deepest)) snprintf(answer->doubt, 160, "this is deeper than the %.1f mm that were prepared", 1e3 * told->deepest);
    else if (!(-local[2] * ROUNDING >= cos(STEEPEST * 0.017453292519943295))) snprintf(answer->doubt, 160, "the direction is more than %.0f degrees off the normal", STEEPEST);
    return 0;
}
