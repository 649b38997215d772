/* Any states, orders and placings, in any configuration that is sound: commands stay in their limits. */
#include "../controls.h"
#include "models.h"
#include "sc_servo.h"
#include "sc_servo_watch.h"

enum { PATH = 64 };

static sc_servo_config sound_config(void)
{
    sc_servo_config config;
    memset(&config, 0, sizeof config);
    config.torque_limit = 0.25f;
    config.torque_slew = 100.0f;
    config.force_limit = 10.0f;
    config.force_slew = 2000.0f;
    config.ramp_s = 0.1f;
    config.damping_Nm_s_per_rad = 0.05f;
    config.rate_cutoff_Hz = 100.0f;
    config.opening_kp = 2.0f;
    config.opening_kd = 0.05f;
    config.opening_ki = 1.0f;
    config.advance_kp = 500.0f;
    config.advance_kd = 10.0f;
    config.advance_ki = 100.0f;
    config.opening_error_limit = config.advance_error_limit = 1.0f;
    config.opening_low = -0.2f;
    config.opening_high = 1.5f;
    config.opening_rate_limit = 30.0f;
    config.advance_rate_limit = 5.0f;
    config.supervisor_ms = 100;
    config.fault_clearings = 3;
    config.tick_us = 1000;
    config.passivity.is_measured = 1;
    config.passivity.rig_damping = 1e-3f;
    config.passivity.rig_coulomb = 5e-3f;
    config.passivity.margin_J = 1e-4f;
    config.passivity.most_damping = 0.05f;
    config.passivity.handle_radius = 0.06f;
    config.passivity.friction_width = 2e-3f;
    config.motor_sign = 1.0f;
    const sc_watch_config watch = {.held_s = 1.0f, .swing_rate = 3.0f, .swing_torque = 0.05f,
                                   .swing_Hz = 8.0f, .runaway_rate = 8.0f, .runaway_speed = 1.0f,
                                   .still_rad = 0.05f, .still_m = 0.005f, .still_torque = 0.05f,
                                   .rest_torque = 0.1f, .rest_share = 0.5f, .jitter_s = 0.05f,
                                   .least_ratio = 0.5f, .most_ratio = 2.0f, .ratio_torque = 0.02f,
                                   .clock_share = 0.05f, .host_clock_share = 0.1f, .stop_low = 0.0f,
                                   .stop_high = 1.2f, .stop_margin = 0.1f, .handle_radius = 0.06f};
    config.watch = watch;
    const sc_plate_config plate = {1, 100000, 0.015f, 0.1f, -1.0f, 1.0f};
    config.plate = plate;
    return config;
}

static sc_state taken_state(input *from, uint32_t *clock)
{
    const uint8_t how = take_byte(from);
    *clock += how & 1 ? 1000u : how & 2 ? take_word(from) % 5000u : 0u;
    const sc_state state = {0, (uint16_t)(how & 4 ? take_word(from) : SC_STATE_MOTOR_ENABLED),
                            how & 8 ? take_word(from) : *clock / 1000u,
                            how & 16 ? take_word(from) : *clock,
                            take_float(from, 0.15f, 0.9f),
                            take_float(from, -0.03f, 0.03f),
                            take_float(from, -0.25f, 0.25f),
                            take_float(from, -4.0f, 4.0f)};
    return state;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    input from = {data, size};
    bench_room room;
    sc_servo_config config = sound_config();
    sc_control_config law = sound_control();
    float opening[PATH], rate[PATH], advance[PATH];
    int32_t stroke[PATH];
    config.passivity.is_measured = take_byte(&from) % 2;
    config.plate.is_estimated = take_byte(&from) % 2;
    change_words(&from, &config, offsetof(sc_servo_config, pieces));
    /* Short, so that a run of some hundred ticks passes them. */
    law.stale_s = 0.01f;
    law.end_s = 0.1f;
    law.approach_s = 0.2f;
    law.sustained_s = 0.005f;
    config.watch.held_s = config.watch.jitter_s = 0.02f;
    change_words(&from, &law, sizeof law);
    sc_model model = taken_model(&from, &room);
    const int has_model = take_byte(&from) % 4 != 0;
    if (!sc_servo_config_is_sound(&config) || (has_model && !sc_model_is_sound(&model))) return 0;
    sc_model_edge_slopes(&model);
    for (int i = 0; i < PATH; i++) {
        opening[i] = take_float(&from, 0.2f, 0.9f);
        rate[i] = take_float(&from, -1.0f, 1.0f);
        advance[i] = 1e-3f * (float)i;
        stroke[i] = i / 8;
    }
    sc_control_task task = {&law, {{0.07f, 0.0f}, {0.0f, 1.0f}, 0.0f, 0.0f, {0.0f, 0.0f}, 0.0f, 0, 1},
                            {opening, rate, advance, stroke, PATH}};
    const int has_task = sc_control_config_is_sound(&law);
    const sc_reference reference = {opening, rate, advance, stroke, PATH, has_task ? &task : NULL};
    sc_orders orders = {take_byte(&from) % 5u, 1, 1, 0.03f, 0, 0};
    sc_servo servo;
    sc_command command = {0, 0, 0, 0.0f, 0.0f};
    uint32_t clock = 0;
    memset(&servo, 0, sizeof servo);
    for (int i = 0; i < 400 && from.size > 0; i++) {
        const uint8_t what = take_byte(&from);
        orders.heartbeat += what & 1;
        if (what % 32 == 30) {
            orders.mode = take_byte(&from) % 6u;
            orders.order++;
        } else if (what % 32 == 28) {
            orders.sheet++;
            orders.crack = take_float(&from, 0.0f, 0.06f);
        } else if (what % 32 == 26) {
            sc_placing placing = {{0.0f, 0.0f, 0.0f, 1.0f, 1.0f}, 1, 0};
            change_words(&from, &placing, sizeof placing);
            sc_servo_place(&config, has_model ? &model : NULL, &servo, &placing);
        } else if (what % 32 == 24) {
            task.contour.number++;
            task.contour.lift = take_byte(&from) % 4 == 0;
            task.contour.point[1] = take_float(&from, -0.03f, 0.03f);
            change_words(&from, &task.contour, sizeof task.contour);
        } else if (what == 255) {
            sc_servo_end(&servo, SC_STOP_ASKED);
        }
        sc_servo_pass(&config, &orders, &servo, what & 2 ? 1000u : take_word(&from) % 50000u);
        const sc_state state = taken_state(&from, &clock);
        const float torque = servo.sent_torque, force = servo.sent_force;
        (void)sc_servo_step(&config, has_model ? &model : NULL, what & 4 ? NULL : &reference, &orders,
                            &servo, &state, &command);
        PROMISED(isfinite(command.torque) && isfinite(command.force));
        PROMISED(fabsf(command.torque) <= config.torque_limit);
        PROMISED(fabsf(command.force) <= config.force_limit);
        const float most = config.torque_slew * 1e-6f * (float)config.tick_us;
        PROMISED(servo.torque == 0.0f || fabsf(servo.torque - torque) <= most * 1.0001f + 1e-6f * config.torque_limit);
        const float push = config.force_slew * 1e-6f * (float)config.tick_us;
        PROMISED(servo.force == 0.0f || fabsf(servo.force - force) <= push * 1.0001f + 1e-6f * config.force_limit);
        if (what & 8) sc_servo_not_sent(&servo);
        else sc_servo_sent(&servo);
        if (what & 16) sc_servo_answered(&servo);
        if (servo.stop_reason) {
            PROMISED(command.torque == 0.0f && command.force == 0.0f);
            break;
        }
    }
    return 0;
}
