/* A plate whose pose is estimated: where it stands in the rig's plane, and the model's step there.
 *
 * The section is the line in which the rig's plane meets the plate's upper face. It begins at the
 * plate's near edge (edge_x, edge_y), seen in the rig's frame, and rises by the angle pitch against
 * the advance. Along it and out of the face are the axes u and v. With the pivot at (x_n, 0)
 *
 *     u_n = cos(pitch) (x_n - edge_x) - sin(pitch) edge_y       contact = stretch X - u_n
 *     v_n = -sin(pitch) (x_n - edge_x) - cos(pitch) edge_y      y_top = -v_n
 *     blade angle against the face: theta / m - pitch
 *
 * so that the model's step, taken with these, gives the energy E = m G(y_top - phi). Its gradient is
 * the torque g (contact + phi tan(psi)), the force -m g (tan(psi) cos(pitch) + sin(pitch)) along the
 * advance, and the pull on each number of the section (sc_pull). With a pitch of 0, the edge at (0,
 * upper_face) and a stretch and thickening of 1 they are the model's own.
 *
 * A new estimate does not step the force: the section moves to it in a straight line within move_s.
 * Where the estimate is not usable, or older than stale_us, the force falls to nothing within fall_s
 * and the model rests, so that nothing is cut unfelt; with the next usable estimate the section is
 * there at once and the force rises over the servo's ramp.
 *
 * Two blades that move hold a plate in their middle: the model is symmetric about the advance, so
 * their pitch is 0, and edge_y is the height of the plate's face when it is centred.
 */
#ifndef SC_PLATE_H
#define SC_PLATE_H

#include "sc_model.h"

typedef struct {
    float edge_x;     /* near edge of the upper face, in the rig's frame [m] ... */
    float edge_y;     /* ... and its height over the pivot [m] */
    float pitch;      /* the face's rise against the advance [rad]; 0 where both blades move */
    float stretch;    /* length of the section per length of the plate along the cut */
    float thickening; /* thickness in the rig's plane over the plate's own */
} sc_section;

/* An estimate, as the supervisor writes it. */
typedef struct {
    sc_section section;
    uint32_t usable; /* 0: lost, or too uncertain for the scene */
    uint32_t age_us; /* of the estimate when it was written */
} sc_placing;

typedef struct {
    uint32_t is_estimated; /* 0: the pose is known; nothing here is looked at */
    uint32_t stale_us;     /* age from which an estimate is not used any more */
    float move_s;          /* time in which the section moves to a new estimate */
    float fall_s;          /* from the full force to none */
    float face_low, face_high; /* upper faces for which the model's release_falls holds [m] */
} sc_plate_config;

/* What the material pushes the plate with, along each number of its section: dE over it, without rate
 * damping [N, N, N m, J]. */
typedef struct {
    float edge_x, edge_y, pitch, stretch;
} sc_pull;

typedef struct {
    sc_section from, to, now;
    float moved_s;  /* since the last estimate */
    float share;    /* of the force that the plate's state lets through, 0 to 1 */
    uint32_t placed; /* any usable estimate since the start */
    uint32_t usable; /* the last one was */
    uint32_t age_us; /* of the last one */
    sc_section booked; /* section at the last rendered frame, and the share of the pull then */
    sc_pull pull;
} sc_plate;

/* 1 if every number is finite and of a plate that these blades can meet: at most 10 m away, pitched
 * by at most 1 rad (not at all between two moving blades), stretch and thickening 1/2 to 2. */
int sc_section_is_sound(const sc_section *section, int32_t moving_blades);

/* 1 if the pose is known, or every time is positive and finite. */
int sc_plate_config_is_sound(const sc_plate_config *config);

/* Take an estimate; one whose section is not sound is not usable. */
void sc_plate_take(const sc_placing *placing, int32_t moving_blades, sc_plate *plate);

/* Let time pass by the host's clock, which ages the estimate. */
void sc_plate_pass(sc_plate *plate, uint32_t elapsed_us);

/* Let time pass by the device's: the section moves on, and the force's share falls, or rises to 1
 * within ramp_s. */
void sc_plate_move(const sc_plate_config *config, float ramp_s, float dt, sc_plate *plate);

/* The model's step on a section; pull may be null. The state's crack is counted in the plate. */
void sc_plate_step(const sc_plate_config *config, const sc_model *model, const sc_section *section,
                   sc_crack *state, float opening, float rate, float advance, sc_step_output *out,
                   sc_pull *pull);

/* Work that the plate's own motion put into the material since the last frame, trapezoidal; share is
 * that of the force now. After a rest the first frame has none. */
double sc_plate_work(sc_plate *plate, int rested, float share, const sc_pull *pull);

/* Torque of the package without friction, blades at rest: where the scene cuts, as a crack runs at
 * this opening; else pressed with the material's front at `crack`. Not a number where a step would
 * be INVALID. */
float sc_plate_torque(const sc_model *model, const sc_section *section, float opening,
                      float advance, float crack);

#endif
