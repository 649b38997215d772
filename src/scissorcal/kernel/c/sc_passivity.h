/* Energy at the port between hand and package, while rendering: books, observer and controller.
 *
 * The books say where the motors' work went. With the share s of the engagement ramp (0 to 1) the
 * package is the s-fold of its model, so the model's energies are booked with the ramp's share:
 *
 *   delivered + stored + fracture + arrest + friction = engaged + limited + late + injected + plate
 *
 * up to what sampling of the model leaves. delivered: work of the motors' torque, as measured where
 * the device measures one; engaged: what engaging in pressed material and raising the ramp there
 * put into it; plate: what who moves an estimated plate put into its material (sc_plate.h);
 * limited: work that torque and force limits keep back (negative where they do); injected: work of
 * the controller's damping (negative); late: work that the motors did beyond what was commanded at
 * each sample, by holding, delay, lag, slews and errors of gain and sign. A loop whose late work is
 * positive gives out energy that nobody put in.
 *
 * The observer adds up late work, less what the rig's own friction takes at the same time, forgets
 * within a second, and never goes below 0: energy that a cut took earlier hides nothing. Beyond a
 * margin the controller adds damping, bounded: min(most, (E - margin) / (T omega^2)).
 * (Hannaford and Ryu 2002, doi:10.1109/70.988969; with the books of a cut added.) */
#ifndef SC_PASSIVITY_H
#define SC_PASSIVITY_H

#include "sc_model.h"
#include "sc_motion.h"
#include "sc_near_rest.h"

typedef struct {
    uint32_t is_measured;  /* the states' motor_torque is what the motor exerts */
    float rig_damping;     /* viscous damping of the rig [N m s/rad] ... */
    float rig_coulomb;     /* ... and its dry friction [N m], which take what a loop creates */
    float margin_J;        /* observed energy up to which no damping is added */
    float most_damping;    /* largest damping that is added [N m s/rad]; 0: none */
    float handle_radius;   /* of a sensor of the hand's force [m]; 0: there is none */
    float friction_width;  /* opening over which rendered friction builds up after a reversal
                              [rad]; 0: friction grows with the rate, as sc_model has it */
} sc_passivity_config;

/* Joules since the start; see above. stored is the energy in the material now. */
typedef struct {
    double delivered_J;
    double stored_J;
    double fracture_J;
    double arrest_J;
    double friction_J;
    double engaged_J;
    double limited_J;
    double late_J;
    double injected_J;
    double hand_J; /* work of the hand, where a sensor measures its force */
    double plate_J;
} sc_ledger;

typedef struct {
    uint32_t started;   /* the last frame was rendered */
    float share;        /* of the ramp, then */
    float model_J;      /* stored in the model, then */
    float given_torque; /* share of the model's torque within the limit, then; and so on */
    float given_force;
    float friction;
    float limited_torque;
    float limited_force;
    float injected;
    float measured;       /* motor torque, then */
    uint32_t was_measured;
    float hand_force;     /* positive closes, then */
    uint32_t had_hand;
    double observed_J;
    sc_anchor anchor;
} sc_port;

/* What passed since the last frame, and what the model answers now. */
typedef struct {
    double turned;    /* [rad] */
    double moved;     /* [m] */
    double delivered; /* work of the motors over that [J] */
    float dt;
    float rate;
    float share;
    float torque_limit;
    float force_limit;
} sc_port_tick;

/* Work of the motors since the last frame: of the torque that the device measured, trapezoidal,
 * else of the one sent. A measured torque is remembered for the next frame. */
double sc_port_delivered(const sc_passivity_config *config, sc_port *port, double turned,
                         double moved, float sent_torque, float sent_force, float measured);

/* Work of the hand since the last frame, by its measured force, trapezoidal; 0 without. What hand and
 * motor give the rig takes: a motor that pushes otherwise than it says makes that negative. */
double sc_port_hand(const sc_passivity_config *config, sc_port *port, double turned, float force);

/* Book a rendered frame and return the torque that the controller adds. */
float sc_port_render(const sc_passivity_config *config, sc_port *port, sc_ledger *ledger,
                     const sc_port_tick *tick, const sc_step_output *step);

/* State that this frame was not rendered: the ramp's share is 0 until the next one that is. */
void sc_port_rest(sc_port *port, sc_ledger *ledger);

/* 1 if every number is finite and >= 0. */
int sc_passivity_is_sound(const sc_passivity_config *config);

#endif
