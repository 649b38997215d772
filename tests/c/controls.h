/* A configuration of the mode CONTROL for tests: a typical rig, 10 N/mm, ticks of 1 ms. */
#ifndef TEST_CONTROLS_H
#define TEST_CONTROLS_H

#include "sc_control.h"

#include <string.h>

static inline void flat_friction(sc_axis_friction *friction, float level)
{
    memset(friction, 0, sizeof *friction);
    friction->fastest = 2.0f;
    for (int i = 0; i < SC_FRICTION_POINTS; i++) {
        friction->positive[i] = friction->negative[i] = level;
    }
}

static inline sc_control_config sound_control(void)
{
    const sc_hybrid_config law = {.axes = 2,
                                  .normal_law = SC_HYBRID_FORCE,
                                  .contact_kd = 60.0f,
                                  .force_ki = 12.0f,
                                  .normal_kp = 2500.0f,
                                  .normal_kd = 100.0f,
                                  .path_kp = 2500.0f,
                                  .path_kd = 100.0f,
                                  .path_ki = 25000.0f,
                                  .path_error_most = 2e-3f,
                                  .force_most = 5.0f,
                                  .force_slew = 20.0f,
                                  .integral_most = 3.0f,
                                  .touch_force = 0.3f,
                                  .leave_force = 0.15f,
                                  .leave_s = 0.02f,
                                  .approach_speed = 0.01f,
                                  .approach_force = 1.5f,
                                  .friction_share = 0.7f,
                                  .slip_rate = 0.02f,
                                  .friction_rate = {1.0f, 0.015f, 0.0f},
                                  .effort_limit = {0.5f, 20.0f, 0.0f},
                                  .least_volume = 0.05f};
    sc_control_config c;
    memset(&c, 0, sizeof c);
    c.law = law;
    c.station = 0.075f;
    c.edge_offset = -0.0054f;
    c.moving_blades = 2.0f;
    c.inertia = 2e-4f;
    c.mass = 0.8f;
    flat_friction(&c.opening, 0.015f);
    flat_friction(&c.advance, 0.8f);
    c.surface_friction = 0.2f;
    c.stiffness = 1e4f;
    c.presliding = 2e-4f;
    c.force_cutoff_Hz = 60.0f;
    c.force_band = 0.08f;
    c.torque_sd = 1e-3f;
    c.least_lever = 0.005f;
    c.tick_s = 1e-3f;
    c.pace_s = 0.2f;
    c.stale_s = 0.1f;
    c.end_s = 1.0f;
    c.lift_gap = 3e-3f;
    c.lift_speed = 0.02f;
    c.away = 2e-3f;
    c.approach_s = 3.0f;
    c.force_stop = 6.0f;
    c.path_stop = 5e-3f;
    c.handle_stop = 1.0f;
    c.sustained_s = 0.05f;
    return c;
}

#endif
