/* A plate made of pieces: stretches of material without a gap along the line of the cut.
 *
 * Each piece has one crack, which begins at its near edge, and strips bonded to one another,
 * each up to its end with a fracture energy. A hole is a gap between two pieces, a layer a piece that
 * overlaps another. Torque, force and energies are the sums over the pieces; friction counts once.
 *
 * A piece of scale s is a uniform sheet: the model's step with its own upper face and energies / s,
 * times s. A crack that runs past the end of its strip goes on in the next one, within the same step,
 * with that one's energy: out of a tougher strip it runs to where the release is what the next one
 * takes (kappa of it in ripples), and what was released beyond is an arrest loss; in front of a
 * tougher strip it stops. Behind the last strip the piece is cut through: what it stored is an arrest
 * loss, and it gives no force until the sheet is fresh. A strip of energy 0 is not cut, as a model.
 *
 * Work of a step: that of a model's step for each piece that is left; and for each strip whose end a
 * crack passes another one, with at most two runs to places of a release and one for each strip that
 * is passed on the way.
 */
#ifndef SC_PIECES_H
#define SC_PIECES_H

#include "sc_model.h"

enum { SC_PIECES_MAX = 16, SC_STRIPS_MAX = 64 };

typedef struct {
    float end;             /* in the plate's frame [m] */
    float fracture_energy; /* [J/m]; 0: not cut */
} sc_strip;

typedef struct {
    float begin;      /* place of its near edge in the plate's frame [m] */
    float upper_face; /* y_top [m] */
    float scale;      /* its response is scale * g */
    int32_t first, count; /* of its strips */
    int32_t release_falls; /* sc_pieces_prepare */
} sc_plate_piece;

typedef struct {
    int32_t count; /* 0: the plate is a uniform sheet, and nothing here is looked at */
    sc_plate_piece piece[SC_PIECES_MAX];
    sc_strip strip[SC_STRIPS_MAX];
} sc_pieces_config;

typedef struct {
    sc_crack crack; /* at the far end once the piece is cut through */
    int32_t strip;  /* in which the crack stands; the piece's count: cut through */
} sc_piece_crack;

/* All 0: a fresh sheet, from the next step on. */
typedef struct {
    uint32_t begun;
    int32_t shown; /* piece of which the last step's output has contact, height and indentation */
    sc_piece_crack of[SC_PIECES_MAX];
} sc_pieces;

/* 1 if a piece's own numbers are: finite, an upper face above 0, a scale above 0 and up to 1000. */
int sc_piece_is_sound(const sc_plate_piece *piece);

/* 1 if there are no pieces, or each is sound and has strips that ascend from its near edge, of finite
 * energies (also divided by the scale) that are not negative, within the limits. */
int sc_pieces_are_sound(const sc_pieces_config *config);

/* Find release_falls of each piece, once, as sc_model_release_falls does; 0 is right, and slower. */
void sc_pieces_prepare(const sc_model *model, sc_pieces_config *config);

/* All cracks at their near edges. Blades that stand closed there touch nothing until they have
 * opened, so that no stored energy appears from nothing. */
void sc_pieces_fresh(const sc_pieces_config *config, sc_pieces *pieces);

/* The step of all pieces. contact, indentation, height and response are those of the piece of the
 * largest response or, where none touches, of the one over which the edge stands lowest. Flags are
 * that piece's, and those of every piece that touches or whose crack advanced. INVALID: nothing
 * changes. */
void sc_pieces_step(const sc_pieces_config *config, const sc_model *model, sc_pieces *pieces,
                    float opening, float rate, float advance, sc_step_output *out);

/* Over n places; the cracks go on from one to the next. */
void sc_pieces_step_many(const sc_pieces_config *config, const sc_model *model, sc_pieces *pieces,
                         int64_t n, const float *opening, const float *rate, const float *advance,
                         sc_step_output *out);

#endif
