/* Answer presses on a body from a portable model file (docs/portable-model.md). C99, the standard library only. */
#ifndef PALPATE_H
#define PALPATE_H
#include <stddef.h>
#include <stdint.h>

typedef struct palpate_model palpate_model;

/* A press: a triangle and the weights of its corners say where, and a force [N], or, if moves is not 0, by how much the
   disc is moved [m], on average over its pressure; then the force is found. At most 16 act at once. */
typedef struct { uint32_t triangle; double weights[3]; int moves; double given[3]; } palpate_press;

/* error: RMSE over peak that nine in ten answers keep; doubt: why the answer is not to be believed, or "" */
typedef struct { double error; char doubt[160]; } palpate_answer;

/* A place that a rigid instrument was prepared at, and the largest errors there of the export's trials straight in: a node of the
   surface that its tip is held against; 0 for a ball or 1 for a punch; [m], and the outward direction */
typedef struct { uint32_t node, kind; double radius, edge, deepest, error, force_error, outward[3]; } palpate_place;

/* The instrument's force on the body [N], the part along its way, the area that it touches [m2], where its tip is [m],
   errors as RMSE over peak and over the force, and why the answer is not to be believed, or "" */
typedef struct { double force[3], along, area, tip[3], error, force_error; char doubt[160]; } palpate_touched;

/* Read a model from the bytes of a file, which are copied. NULL, and one sentence in why, where they are none. */
palpate_model *palpate_load(const void *bytes, size_t count, char why[160]);
void palpate_free(palpate_model *model);

uint32_t palpate_nodes(const palpate_model *model, const float **positions);     /* 3 a node [m] */
uint32_t palpate_triangles(const palpate_model *model, const uint32_t **corners); /* 3 a triangle */
const char *palpate_info(const palpate_model *model);                             /* the header, JSON, not read here */

/* Write the displacement (3 a node) [m] of the whole surface, and the forces (3 a press) [N], given or found. If go_on is
   not 0 it begins where the model's last answer ended, which saves time where the presses are similar and in the same
   order. Returns 0, or -1 with a sentence in the doubt for presses that are none, or without memory; then nothing else
   is written. A model may be used by one thread at a time. */
int palpate_respond(palpate_model *model, const palpate_press *presses, size_t count, int go_on, float *displacement,
                    double *forces, palpate_answer *answer);

/* Push the instrument of a place from first touch to a depth [m] along a direction (3), or straight in if that is NULL, and
   write the displacement. Returns 0, or -1 with a sentence in the doubt for a touch that is none. */
uint32_t palpate_places(const palpate_model *model, const palpate_place **places);
int palpate_touch(palpate_model *model, uint32_t place, double depth, const double *direction, float *displacement,
                  palpate_touched *answer);
#endif
