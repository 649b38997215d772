#include "sc_servo_plate.h"

#include <string.h>

void sc_servo_place(const sc_servo_config *config, const sc_model *model, sc_servo *servo,
                    const sc_placing *placing)
{
    if (config->plate.is_estimated && model != NULL) {
        sc_plate_take(placing, model->moving_blades, &servo->plate);
    }
}

void sc_servo_move_plate(const sc_servo_config *config, sc_servo *servo, float dt)
{
    if (config->plate.is_estimated) {
        sc_plate_move(&config->plate, config->ramp_s, dt, &servo->plate);
    }
}

static int step_on_plate(const sc_servo_config *config, const sc_model *model, sc_servo *servo,
                         float *share)
{
    const sc_motion *motion = &servo->motion;
    sc_plate *plate = &servo->plate;
    sc_pull pull;
    if (plate->share < 1.0f) {
        servo->sample.flags |= SC_SAMPLE_PLATE_OUT;
        servo->plate_out_frames++;
    }
    if (!(plate->share > 0.0f)) {
        sc_port_rest(&servo->port, &servo->ledger);
        memset(&servo->step, 0, sizeof servo->step);
        return 0;
    }
    *share *= plate->share;
    sc_plate_step(&config->plate, model, &plate->now, &servo->crack, motion->opening,
                  motion->opening_rate, motion->advance, &servo->step, &pull);
    servo->ledger.plate_J += sc_plate_work(plate, !servo->port.started, *share, &pull);
    return 1;
}

int sc_servo_step_model(const sc_servo_config *config, const sc_model *model, sc_servo *servo,
                        float *share)
{
    const sc_motion *motion = &servo->motion;
    if (config->plate.is_estimated) {
        return step_on_plate(config, model, servo, share);
    }
    if (config->pieces.count > 0) {
        sc_pieces_step(&config->pieces, model, &servo->pieces, motion->opening,
                       motion->opening_rate, motion->advance, &servo->step);
        servo->crack = servo->pieces.of[servo->pieces.shown].crack;
        return 1;
    }
    sc_model_step(model, &servo->crack, motion->opening, motion->opening_rate, motion->advance,
                  &servo->step);
    return 1;
}
